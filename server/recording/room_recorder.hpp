// The recording of one room.
//
//   room thread                          recorder thread
//   on_command, on_input ──┐
//   on_step: hashes, states ──ring──▶    drain(): whole steps to messages ▶ RecordingFile
//
// A step that does not find place in the ring is left out as a whole, and counted; so is what the disk does not take.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/realtime/ring.hpp"
#include "common/recording/recording_file.hpp"
#include "server/recording/step_codec.hpp"

namespace tandem::server {

struct RoomRecording {
  std::filesystem::path file;
  std::string program;          ///< with its version
  std::string scene_file{};     ///< as it was named
  std::uint64_t recording = 0;  ///< a number that the files of one recording share
  Duration unix_offset{0};      ///< from the room's clock to the time since 1970
  double states_hz = 50;        ///< how often it says where everything is; at most each step
  std::size_t capacity = 4096;  ///< of the ring: records, one for each step, command, input and state
  recording::RotationSettings rotation{};
  std::optional<wire::RoomCheckpoint> restored{};  ///< what the room begins with
};

class RoomRecorder final : public RoomWatcher {
 public:
  /// Makes the file. The room must not have stepped yet.
  /// Fails   std::invalid_argument: the file cannot be made
  RoomRecorder(const Room& room, RoomRecording settings);
  ~RoomRecorder() override;

  void on_command(const RoomCommand& command) noexcept override;
  void on_input(std::size_t seat, const proto::ClientUpdate& input) noexcept override;
  void on_step(const Room& room, ServerTime now, TickFaults faults) noexcept override;

  /// Writes what waits, and flushes when it is due. One thread, not the room's.
  void drain();
  /// After the last step: writes all and the end.
  void finish();

  /// Steps that are not in the recording. Thread  any
  std::uint64_t steps_lost() const { return steps_lost_.load(std::memory_order_relaxed); }
  /// Thread  as drain(); its counters: any
  const recording::RecordingFile& file() const { return file_; }
  /// What a person should be told since the last call; empty: nothing. Thread  as drain()
  std::string take_news();

 private:
  struct Stepped {
    ServerTime now{};
    TickFaults faults = 0;
    std::uint32_t records = 0;  ///< of this step before this one
    double field_energy_kj_per_mol = 0;
    bool has_states = false;
    StateHashes hashes;
  };
  struct ToolRecord {
    std::uint8_t tool = 0;
    UserId user;
    RigidState state;
    Wrench on_hand_W;
    BodyId held;
  };
  /// `step` tells what belongs together.
  struct Record {
    std::uint64_t step = 0;
    std::variant<RoomCommand, TakenInput, proto::BodyState, ToolRecord, Stepped> what;
  };

  template <class What>
  void push(const What& what) noexcept;
  void push_states(const Room& room) noexcept;
  wire::RecordedRoom description(std::uint32_t part) const;
  void take(const Record& record);
  void write_step(const Record& record, const Stepped& stepped);

  RoomRecording settings_;
  wire::RecordedRoom description_;
  std::vector<BodyId> moving_bodies_;
  std::uint64_t states_every_ = 1;
  realtime::Ring<Record> ring_;
  std::atomic<std::uint64_t> steps_lost_{0};

  // The room's thread.
  std::uint64_t step_ = 1;  ///< under way
  std::uint32_t records_ = 0;
  bool is_losing_ = false;

  // The recorder's.
  recording::RecordingFile file_;
  Record record_;
  std::uint64_t taken_step_ = 0;
  std::uint32_t taken_records_ = 0;
  wire::RecordedStep message_;
  wire::RecordedStates states_;
  std::uint64_t newest_ns_ = 0, flushed_ns_ = 0, told_lost_ = 0;
};

}  // namespace tandem::server
