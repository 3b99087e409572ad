// Recording of one room.
//
//   room thread                          recorder thread
//   on_command, on_input ──┐
//   on_step: hashes, states ──ring──▶    drain(): complete steps to messages ▶ RecordingFile
//
// If a record of a step does not fit into the ring, the whole step is discarded and counted. Messages that the disk
// does not accept are discarded and counted by RecordingFile.
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
  std::string program;          ///< name and version of the recording program
  std::string scene_file{};     ///< file name as given by the user
  std::uint64_t recording = 0;  ///< number shared by the files of one recording
  Duration unix_offset{0};      ///< Unix time minus time of the room's clock
  double states_hz = 50;        ///< rate of recorded states; limited to one per step
  std::size_t capacity = 4096;  ///< capacity of the ring, in records; each step, command, input and state needs one
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

  /// Writes the pending steps, and flushes the file if this is due. All calls must come from one thread, which must not
  /// be the room thread.
  void drain();
  /// Writes all remaining steps and closes the file. Call after the last step.
  void finish();

  /// Number of steps that were discarded because the ring was full. Thread: any.
  std::uint64_t steps_lost() const { return steps_lost_.load(std::memory_order_relaxed); }
  /// Thread  the thread of drain(); its counters may be read on any thread
  const recording::RecordingFile& file() const { return file_; }
  /// Message for the operator that arose since the last call; empty if there is none. Thread: the thread of drain().
  std::string pop_news();

 private:
  struct Stepped {
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
  /// Entry of the ring. All records of one step have the same value of `step`.
  struct Record {
    std::uint64_t step = 0;
    std::variant<RoomCommand, TakenInput, proto::BodyState, ToolRecord, GameEvent, GameStatus, Stepped> what;
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

  // Used by the room thread only.
  std::uint64_t step_ = 1;  ///< number of the current step
  std::uint32_t records_ = 0;
  bool is_losing_ = false;

  // Used by the recorder thread only.
  recording::RecordingFile file_;
  Record record_;
  std::uint64_t taken_step_ = 0;
  std::uint32_t taken_records_ = 0;
  wire::RecordedStep message_;
  wire::RecordedStates states_;
  std::uint64_t newest_ns_ = 0, flushed_ns_ = 0, reported_lost_ = 0;
};

}  // namespace tandem::server
