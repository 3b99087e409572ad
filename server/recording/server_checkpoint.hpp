// Checkpoint file from which a server resumes after a crash: the state of its rooms, and the credentials of users who
// may resume.
//
//   room threads ──mailbox each 100 ms──┐
//   io thread ──mailbox, each change────┴▶ checkpoint thread: one file every 0.5 s, at once after a join or kick
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/recording/recorder_thread.hpp"
#include "server/recording/room_checkpoint.hpp"
#include "server/room/server_rooms.hpp"
#include "tandem/checkpoint.pb.h"

namespace tandem::server {

/// The file is written under another name, flushed to disk and renamed, so a reader finds either the old or the new
/// state.
class ServerCheckpoint final : public RoomService {
 public:
  /// Resumes the rooms from the file, and watches them while they step. A room's state is ignored if it is older than
  /// the room's limits.reset_after_s, or of another scene.
  /// In      folder  used by this server only (lock_state() of server/app)
  ///         rooms  not stepping yet
  ///         audience  the server's key; empty: no credentials
  ///         unix_ms  milliseconds since 1970, for the age at the next start; writes are timed by a monotonic clock
  ///         on_news  messages for the operator; called here and on the thread
  ServerCheckpoint(const std::filesystem::path& folder, const std::vector<std::unique_ptr<Room>>& rooms,
                   std::string audience, std::function<std::uint64_t()> unix_ms,
                   std::function<void(const std::string&)> on_news);
  ~ServerCheckpoint() override;
  ServerCheckpoint(const ServerCheckpoint&) = delete;
  ServerCheckpoint& operator=(const ServerCheckpoint&) = delete;

  /// State of the previous run; empty if there is none, or if that server had another key.
  const wire::AdmissionState& admission() const { return admission_; }
  /// State from which a room resumed; nothing: it started as in its scene.
  const std::optional<wire::RoomCheckpoint>& restored(std::size_t room) const { return restored_.at(room); }
  /// Stores the admission state to be written.
  /// Thread  io
  void note(const wire::AdmissionState& admission);
  /// Starts the thread; without it, the caller must call work().
  void start();
  /// Writes changes, at most every 0.5 s. Retries a failed write with a back-off of 0.5 s to 8 s, also while no room is
  /// awake.
  /// Thread  checkpoint
  void work(LocalTime now);
  /// Writes the final state. Call after the rooms' last steps, while the rooms exist. Idempotent.
  void finish() override;
  /// Number of successful and of failed writes. Thread: any.
  std::uint64_t writes() const { return writes_.load(std::memory_order_relaxed); }
  std::uint64_t failures() const { return failures_.load(std::memory_order_relaxed); }

 private:
  class Watch;
  void read();
  void resume(const wire::ServerCheckpoint& before);
  void write(LocalTime now);

  std::filesystem::path file_;
  std::string audience_;
  std::function<std::uint64_t()> unix_ms_;
  std::function<void(const std::string&)> on_news_;
  std::vector<Room*> rooms_;
  std::vector<std::unique_ptr<Watch>> watches_;
  wire::AdmissionState admission_;
  std::vector<std::optional<wire::RoomCheckpoint>> restored_;
  realtime::Mailbox<std::string> admissions_;  ///< serialised
  // Used by the checkpoint thread only.
  wire::ServerCheckpoint newest_;
  std::optional<LocalTime> next_{};  ///< next write; nothing: no write yet
  Duration back_off_{};              ///< 0: the last write succeeded
  bool is_finished_ = false;
  std::atomic<std::uint64_t> writes_{0}, failures_{0};
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server
