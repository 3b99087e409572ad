// Checkpoint file from which a server resumes after a crash. It contains the state of the rooms, and the credentials of
// users who may resume their sessions.
//
//   room threads ──one mailbox each, every 100 ms──┐
//   io thread ──mailbox, after every change────────┴▶ checkpoint thread: writes the file every 0.5 s, and immediately
//                                                     after credentials change
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

/// Checkpoint of a server. Each state is written to a temporary file, which is flushed to disk and then renamed. A
/// reader therefore finds either the old or the new state, always complete.
class ServerCheckpoint final : public RoomService {
 public:
  /// Resumes the rooms from the file, and then observes their steps. The stored state of a room is ignored in two
  /// cases: it belongs to another scene, or its age exceeds both kResumeWithin and the scene's limits.reset_after_s.
  /// With a reset_after_s of 0 it never becomes too old.
  /// In      folder  must be used by this server only (lock_state() of server/app)
  ///         rooms  must not step before the constructor returns
  ///         audience  public key of the server; empty for a server without key, which has no credentials
  ///         unix_ms  returns the current time [ms since 1970]. It is stored in the file, so that the next start can
  ///                  compute the age of the file. The period of writes is measured by a monotonic clock
  ///         on_news  receives messages for the operator; called in the constructor and on the checkpoint thread
  ServerCheckpoint(const std::filesystem::path& folder, const std::vector<std::unique_ptr<Room>>& rooms,
                   std::string audience, std::function<std::uint64_t()> unix_ms,
                   std::function<void(const std::string&)> on_news);
  ~ServerCheckpoint() override;
  ServerCheckpoint(const ServerCheckpoint&) = delete;
  ServerCheckpoint& operator=(const ServerCheckpoint&) = delete;

  /// Returns the admission state of the previous run; empty if there is none, or if the previous server had another
  /// key.
  const wire::AdmissionState& admission() const { return admission_; }
  /// State from which a room resumed; none if the room started from its scene.
  const std::optional<wire::RoomCheckpoint>& restored(std::size_t room) const { return restored_.at(room); }
  /// Sets the admission state to be written.
  /// Thread  io
  void note(const wire::AdmissionState& admission);
  /// Starts the checkpoint thread, which calls work(). If the thread is not started, the caller must call work().
  void start();
  /// Writes the file if the state has changed. Changes of rooms are written at most every 0.5 s, those of credentials
  /// immediately. A failed write is retried with a back-off of 0.5 s to 8 s, even if all rooms are idle.
  /// Thread  checkpoint
  void work(LocalTime now);
  /// Writes the final state. Call it after the last steps of the rooms and before they are destroyed. Repeated calls
  /// have no effect.
  void finish() override;
  /// Numbers of successful and of failed writes. Thread: any.
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
  realtime::Mailbox<std::string> admissions_;  ///< serialised wire::AdmissionState
  // Members for the checkpoint thread only.
  wire::ServerCheckpoint newest_;
  std::optional<LocalTime> next_{};  ///< earliest time of the next write; none before the first call of work()
  Duration back_off_{};              ///< time until the next attempt after a failed write; 0 if the last one succeeded
  bool is_finished_ = false;
  std::atomic<std::uint64_t> writes_{0}, failures_{0};
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server
