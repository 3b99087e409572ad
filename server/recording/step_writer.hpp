// Records that a room passes to its recorder, and the conversion of records to messages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <variant>

#include "common/recording/recording_file.hpp"
#include "server/recording/step_codec.hpp"

namespace tandem::server {

/// Last record of a step.
struct StepEnd {
  ServerTime now{};
  TickFaults faults = 0;
  std::uint32_t records = 0;  ///< number of records of this step that precede this one
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
/// Part of a step. All records of one step have the same value of `step`.
struct StepRecord {
  std::uint64_t step = 0;
  std::variant<RoomCommand, TakenInput, proto::BodyState, ToolRecord, GameEvent, GameStatus, StepEnd> what;
};

/// Indices of the topics in the file, in the order of its channels.
enum RecordedTopic : std::uint16_t { kRoomTopic, kStepTopic, kStatesTopic };

/// Writes complete steps to a recording. A step with missing records is not written.
///
/// Thread  the recorder thread
class StepWriter {
 public:
  /// In      writer       has the channels of RecordedTopic
  ///         unix_offset  Unix time minus time of the room's clock
  /// Fails   the exceptions of RecordingFile
  StepWriter(std::filesystem::path file, recording::McapWriter writer, recording::RotationSettings rotation,
             recording::RecordingFile::Describe describe, Duration unix_offset);

  /// Adds a record to the messages of its step. The last record of the step completes these messages, and they are
  /// written.
  void write(const StepRecord& record);
  /// Flushes the file if the newest step is 250 ms later than the last flush. If no step was written since the last
  /// call, the room is idle, and the file is flushed as well.
  void flush_if_due();

  recording::RecordingFile& file() { return file_; }
  const recording::RecordingFile& file() const { return file_; }

 private:
  void write_step(std::uint64_t step, const StepEnd& end);

  recording::RecordingFile file_;
  Duration unix_offset_;
  std::uint64_t step_ = 0;
  std::uint32_t records_ = 0;  ///< number of records of this step so far
  wire::RecordedStep message_;
  wire::RecordedStates states_;
  /// Times of three steps [ns]: the newest step, the newest step at the last check, and the newest step at the last
  /// flush.
  std::uint64_t newest_ns_ = 0, checked_ns_ = 0, flushed_ns_ = 0;
};

}  // namespace tandem::server
