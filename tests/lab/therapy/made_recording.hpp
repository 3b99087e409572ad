// Makes recordings of a room, message by message, as input for tests.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "common/base/spatial.hpp"
#include "common/recording/mcap_writer.hpp"
#include "proto/recording/exact_state.hpp"
#include "proto/recording/schema.hpp"
#include "tandem/recording.pb.h"

namespace tandem::lab {

/// Writes the steps of a room, one per millisecond. Every 20th step contains states.
class MadeRecording {
 public:
  static constexpr std::uint64_t kBegin_ns = 1'796'000'000'000'000'000;  // a time in November 2026

  explicit MadeRecording(std::uint64_t recording = 1)
      : writer_({proto::channel_of("/room", wire::RecordedRoom()), proto::channel_of("/step", wire::RecordedStep()),
                 proto::channel_of("/states", wire::RecordedStates())},
                "test") {
    bytes_ = writer_.begin();
    room.set_part(1);
    room.set_recording(recording);
    room.mutable_scene()->set_name("made");
  }

  /// Adds a level with goals to the scene.
  wire::Level& level(const std::string& name, const std::vector<std::string>& goals) {
    wire::Level& level = *room.mutable_scene()->mutable_game()->add_levels();
    level.set_name(name);
    for (const std::string& goal : goals) level.add_goals()->set_name(goal);
    return level;
  }
  /// Adds a join command to the next step.
  void join(std::uint32_t seat, const std::string& name, wire::Role role = wire::ROLE_MANIPULATOR) {
    wire::RecordedCommand& command = *step_.add_commands();
    command.set_kind(wire::RecordedCommand::JOIN);
    command.set_seat(seat);
    command.set_user(seat + 1);
    command.set_role(role);
    command.set_user_name(name);
  }
  void leave(std::uint32_t seat) {
    wire::RecordedCommand& command = *step_.add_commands();
    command.set_kind(wire::RecordedCommand::LEAVE);
    command.set_seat(seat);
    command.set_user(seat + 1);
  }
  void event(wire::GameEvent::Kind kind, std::uint32_t level, std::uint32_t goal = 0, double score = 0) {
    wire::GameEvent& event = *step_.add_game_events();
    event.set_kind(kind);
    event.set_level(level);
    event.set_goal(goal);
    event.set_score(score);
  }
  /// Adds steps in which seat 0 has an input. `position` returns the position of the hand at a time since the beginning
  /// of the recording [s].
  void run(double seconds, const std::function<Vec3(double)>& position) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds * 1000)); ++i) {
      wire::RecordedInput& input = *step_.add_inputs();
      input.set_seat(0);
      input.mutable_update()->set_handle_valid(true);
      proto::write_exact(RigidState{{position(now_s()), Quat::Identity()}, {}},
                         *input.mutable_update()->mutable_handle());
      if (has_client_clock) {
        input.mutable_update()->set_sent_local_ns(5'000'000'000 + steps_ * 1'000'000);
      }
      end_step();
    }
  }
  /// Ends the current chunk of the file. Each chunk has a checksum, so damage in later messages does not invalidate the
  /// messages before this call.
  void begin_chunk() {
    const auto chunk = writer_.pop_chunk();
    bytes_.insert(bytes_.end(), chunk.begin(), chunk.end());
    chunk_begin_ = bytes_.size();
  }
  /// Adds a message that cannot be parsed as a step.
  void damaged_step() {
    const std::string text = "\xff\xff\xff\xff\xff";
    writer_.add(1, kBegin_ns + steps_ * 1'000'000,
                std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  }
  std::size_t bytes_until_chunk() const { return chunk_begin_; }
  double now_s() const { return static_cast<double>(steps_) * 1e-3; }

  void write(const std::filesystem::path& file) {
    const std::size_t chunk_begin = chunk_begin_;
    begin_chunk();
    chunk_begin_ = chunk_begin;
    const auto end = writer_.finish();
    bytes_.insert(bytes_.end(), end.begin(), end.end());
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
  }

  wire::RecordedRoom room;
  Vec3 force_n = Vec3::Zero();
  std::uint32_t held_body = 0;
  bool has_client_clock = true;
  /// simulated network delay of the inputs: added to the arrival times of the following steps
  std::uint64_t network_delay_ns = 0;

 private:
  void end_step() {
    if (steps_ == 0) writer_.add(0, kBegin_ns, proto::bytes_of(room));
    const std::uint64_t at_ns = kBegin_ns + steps_ * 1'000'000 + network_delay_ns;
    step_.set_step(steps_ + 1);
    writer_.add(1, at_ns, proto::bytes_of(step_));
    step_.Clear();
    if (steps_ % 20 == 0) {
      wire::RecordedStates states;
      wire::RecordedTool& tool = *states.add_tools();
      tool.set_user(1);
      proto::write_exact(Wrench{force_n, Vec3::Zero()}, *tool.mutable_wrench_on_hand());
      tool.set_held_body(held_body);
      writer_.add(2, at_ns, proto::bytes_of(states));
    }
    ++steps_;
  }

  recording::McapWriter writer_;
  recording::Bytes bytes_;
  wire::RecordedStep step_;
  std::uint64_t steps_ = 0;
  std::size_t chunk_begin_ = 0;
};

}  // namespace tandem::lab
