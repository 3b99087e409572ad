// What a server keeps on disk to go on from when it was killed: where everything in its rooms is, who may come back, and
// which tokens were used.
//
//   room threads ──mailbox each 100 ms──┐
//   io thread ──mailbox, each change────┴▶ checkpoint thread: one file, each 0.5 s, at once when somebody joined or was kicked
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

/// The file is written under another name, flushed to the disk and renamed: whoever reads it finds one whole state or the next.
class ServerCheckpoint final : public RoomService {
 public:
  /// In a folder that is this server's alone (lock_state() of server/app): lets the rooms go on from what it holds, and watches them
  /// from then on, as long as they step; they do not yet. A state that is older than a room's limits.reset_after_s, or of another
  /// scene, is ignored.
  /// In      audience  the server's key; empty: no credentials
  ///         unix_ms  milliseconds since 1970, for the age at the next start; writes are timed by a monotonic clock
  ///         on_news  for people; called here and on the thread
  ServerCheckpoint(const std::filesystem::path& folder, const std::vector<std::unique_ptr<Room>>& rooms,
                   std::string audience, std::function<std::uint64_t()> unix_ms,
                   std::function<void(const std::string&)> on_news);
  ~ServerCheckpoint() override;
  ServerCheckpoint(const ServerCheckpoint&) = delete;
  ServerCheckpoint& operator=(const ServerCheckpoint&) = delete;

  /// Of before; empty: nothing, or of a server with another key.
  const wire::AdmissionState& admission() const { return admission_; }
  /// What a room goes on from; nothing: as its scene says.
  const std::optional<wire::RoomCheckpoint>& restored(std::size_t room) const { return restored_.at(room); }
  /// Thread  io
  void note(const wire::AdmissionState& admission);
  /// Starts the thread; without it work() is the caller's to call.
  void start();
  /// Writes what is new, each 0.5 s at most. A write that failed is tried again after 0.5 s to 8 s, also while no room is awake.
  /// Thread  the checkpoint's
  void work(LocalTime now);
  /// While the rooms are there, after their last steps: writes how they are. Idempotent.
  void finish() override;
  /// How often it has been written, and how often it could not. Thread  any
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
  // The thread's.
  wire::ServerCheckpoint newest_;
  std::optional<LocalTime> next_{};  ///< write; nothing: none was yet
  Duration back_off_{};              ///< 0: the last write has worked
  bool is_finished_ = false;
  std::atomic<std::uint64_t> writes_{0}, failures_{0};
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server
