// The program that a server runs when a game calls a person who looks after its users (tandem-server --on-call).
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "common/base/time.hpp"
#include "server/room/server_rooms.hpp"

namespace tandem::server {

/// Runs the program once for each call, without a shell, one after the other. Its arguments are the name of the room and
/// the reason. It is killed when it takes longer than the limit. Its input is empty, and its output goes to stderr.
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

  /// Queues a run. Beyond kMaxWaiting, it is reported as failed.
  void call(const std::string& room, const std::string& reason);
  /// Lets a running program go on for at most a second. Waiting calls are not begun, and are reported.
  void finish() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
