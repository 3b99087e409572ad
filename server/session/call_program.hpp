// The program that a server runs when a game calls a person who looks after its users (tandem-server --on-call).
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "common/base/time.hpp"
#include "server/room/server_rooms.hpp"

namespace tandem::server {

/// Runs a program once for each call. Calls are executed one after the other.
/// * Arguments: the name of the room and the reason of the call. No shell is used.
/// * Limit: a run that takes longer is killed.
/// * Input and output: stdin is empty, and stdout goes to the server's stderr.
///
/// Thread  call(): io, which waits for nothing but a lock; a thread of its own waits for the program
class CallProgram final : public RoomService {
 public:
  static constexpr std::size_t kMaxWaiting = 16;
  static constexpr Duration kLimit = std::chrono::seconds(10);

  /// In      on_news  gets a line for the operator about each run: its duration and exit code, or why it failed;
  ///                  called on the thread of the program
  /// Fails   std::invalid_argument: the file cannot be executed
  CallProgram(const std::filesystem::path& program, std::function<void(const std::string&)> on_news,
              Duration limit = kLimit);
  ~CallProgram() override;

  /// Queues a run of the program. If kMaxWaiting runs are queued already, the call is reported as failed.
  void call(const std::string& room, const std::string& reason);
  /// Grants a running program at most one more second. Queued runs are not started, and are reported to the operator.
  void finish() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
