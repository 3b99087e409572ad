// Recording of one room.
//
//   room thread                          recorder thread
//   on_command, on_input ──┐
//   on_step: hashes, states ──ring──▶    drain(): complete steps to messages ▶ RecordingFile
//
// If a record does not fit into the ring, its whole step is discarded and counted. Messages that cannot be written to
// disk are discarded and counted by RecordingFile.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/realtime/ring.hpp"
#include "server/recording/step_writer.hpp"

namespace tandem::server {

struct RoomRecording {
  std::filesystem::path file;
  std::string program;          ///< name and version of the recording program
  std::string scene_file{};     ///< scene as the user named it on the command line
  std::uint64_t recording = 0;  ///< number shared by the files of one recording
  Duration unix_offset{0};      ///< Unix time minus the time of the room's clock
  double states_hz = 50;        ///< rate of recorded states; limited to one per step
  /// Ring capacity [records]; a step takes one record, plus one for each of its commands, inputs and states.
  std::size_t capacity = 4096;
  recording::RotationSettings rotation{};
  std::optional<wire::RoomCheckpoint> restored{};  ///< state from which the room resumes; none if it starts anew
};

class RoomRecorder final : public RoomWatcher {
 public:
  /// Creates the file. The room must not have stepped yet.
  /// Fails   std::invalid_argument if the file cannot be created
  RoomRecorder(const Room& room, RoomRecording settings);
  ~RoomRecorder() override;

  void on_command(const RoomCommand& command) noexcept override;
  void on_input(std::size_t seat, const proto::ClientUpdate& input) noexcept override;
  void on_step(const Room& room, ServerTime now, TickFaults faults) noexcept override;

  /// Writes the pending steps. Flushes the file if the last flush is long enough ago (StepWriter::flush_if_due()).
  /// Always call it on the same thread, which must not be the room thread.
  void drain();
  /// Writes all remaining steps and closes the file. Call after the last step.
  void finish();

  /// Number of steps that were discarded because the ring was full. Thread: any.
  std::uint64_t steps_lost() const { return steps_lost_.load(std::memory_order_relaxed); }
  /// Returns the file of the recording.
  /// Thread  the thread of drain(); the counters of the file may be read on any thread
  const recording::RecordingFile& file() const { return writer_.file(); }
  /// Returns the message for the operator that has arisen since the last call; empty if there is none. Thread: the
  /// thread of drain().
  std::string pop_news();

 private:
  template <class What>
  void push(const What& what) noexcept;
  void push_states(const Room& room) noexcept;
  wire::RecordedRoom description(std::uint32_t part) const;

  RoomRecording settings_;
  wire::RecordedRoom description_;
  std::vector<BodyId> moving_bodies_;
  std::uint64_t states_every_ = 1;
  realtime::Ring<StepRecord> ring_;
  std::atomic<std::uint64_t> steps_lost_{0};

  // Members for the room thread only.
  std::uint64_t step_ = 1;  ///< number of the current step
  std::uint32_t records_ = 0;
  bool is_losing_ = false;

  // Members for the recorder thread only.
  StepWriter writer_;
  StepRecord record_;
  std::uint64_t reported_lost_ = 0;
};

}  // namespace tandem::server
