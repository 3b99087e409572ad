// A server with real sockets on a loopback port, in a thread of this process.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/net/live_server.hpp"
#include "tests/support/scene_of.hpp"

namespace tandem::test {

/// Waits until `is_true` returns true, at most 30 s. Only a program that hangs exceeds this limit.
inline bool eventually(const std::function<bool()>& is_true) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!is_true()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

class RunningServer {
 public:
  explicit RunningServer(const std::string& scene_json, server::LiveServerSettings settings = {.port = 0}) {
    const auto scene = scene_of(scene_json);
    std::vector<std::unique_ptr<server::Room>> rooms;
    rooms.push_back(std::make_unique<server::Room>(RoomId{1}, scene->description.name(), scene));
    server = std::make_unique<server::LiveServer>(settings, std::move(rooms));
    server->on_log = [this](std::string_view, const std::string& line) {
      const std::lock_guard lock(mutex_);
      log_.push_back(line);
    };
    thread_ = std::thread([this] { server->run(); });
  }
  ~RunningServer() { stop(); }

  /// Stops the server. It sends a goodbye message to each client.
  void stop() {
    if (!thread_.joinable()) return;
    server->stop();
    thread_.join();
  }
  /// Ends the server like kill −9: the sockets are closed without a message.
  void kill() {
    server->abandon();
    thread_.join();
    server.reset();
  }
  /// Blocks the io thread at its next log line until the returned lock is released.
  std::unique_lock<std::mutex> hold_io() { return std::unique_lock(mutex_); }
  bool has_logged(const std::string& words) {
    const std::lock_guard lock(mutex_);
    for (const std::string& line : log_) {
      if (line.find(words) != std::string::npos) return true;
    }
    return false;
  }

  std::unique_ptr<server::LiveServer> server;

 private:
  std::mutex mutex_;
  std::vector<std::string> log_;
  std::thread thread_;
};

}  // namespace tandem::test
