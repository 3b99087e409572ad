// Recording of one room.
//
//   room thread                          recorder thread
//   on_command, on_input ──┐
//   on_step: hashes, states ──ring──▶    drain(): whole steps to messages ▶ RecordingFile
//
// A step that does not fit into the ring is dropped as a whole and counted; so is a step that the disk does not accept.
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
  std::string program;          ///< including its version
  std::string scene_file{};     ///< file name as given by the user
  std::uint64_t recording = 0;  ///< number shared by the files of one recording
  Duration unix_offset{0};      ///< from the room's clock to Unix time
  double states_hz = 50;        ///< rate of recorded states; at most one per step
  std::size_t capacity = 4096;  ///< records in the ring, one for each step, command, input and state
  recording::RotationSettings rotation{};
  std::optional<wire::RoomCheckpoint> restored{};  ///< state that the room resumes from
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

  /// Writes the pending steps, and flushes when due. Call from one thread, not the room's.
  void drain();
  /// Writes all remaining steps and closes the file. Call after the last step.
  void finish();

  /// Number of steps missing from the recording. Thread: any.
  std::uint64_t steps_lost() const { return steps_lost_.load(std::memory_order_relaxed); }
  /// Thread  that of drain(); counters: any
  const recording::RecordingFile& file() const { return file_; }
  /// News for the operator since the last call; empty: none. Thread: that of drain().
  std::string pop_news();

 private:
  struct Stepped {
    ServerTime now{};
    TickFaults faults = 0;
    std::uint32_t records = 0;  ///< number of earlier records of this step
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
  /// Ring entry; records of one step have the same `step`.
  struct Record {
    std::uint64_t step = 0;
    std::variant<RoomCommand, TakenInput, proto::BodyState, ToolRecord, Stepped> what;
  };

  template <class What>
  void push(const What& what) noexcept;
  void push_states(const Room& room) noexcept;
  wire::RecordedRoom description(std::uint32_t part) const;
  void write(const Record& record);
  void write_step(const Record& record, const Stepped& stepped);

  RoomRecording settings_;
  wire::RecordedRoom description_;
  std::vector<BodyId> moving_bodies_;
  std::uint64_t states_every_ = 1;
  realtime::Ring<Record> ring_;
  std::atomic<std::uint64_t> steps_lost_{0};

  // Used by the room's thread only.
  std::uint64_t step_ = 1;  ///< current step
  std::uint32_t records_ = 0;
  bool is_losing_ = false;

  // Used by the recorder's thread only.
  recording::RecordingFile file_;
  Record record_;
  std::uint64_t taken_step_ = 0;
  std::uint32_t taken_records_ = 0;
  wire::RecordedStep message_;
  wire::RecordedStates states_;
  std::uint64_t newest_ns_ = 0, flushed_ns_ = 0, reported_lost_ = 0;
};

}  // namespace tandem::server
