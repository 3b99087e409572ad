// Why a program that moves a hand has a thread for signals: main also writes files, and what is behind a file can block
// for ever (a pipe, a disk far away). Whoever takes the signals must never write, or nobody could end the force.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

namespace tandem::client {

/// Blocks SIGINT, SIGTERM, SIGQUIT and, unless the program was started to ignore it (nohup), SIGHUP for this thread
/// and those it starts; ignores SIGPIPE, so that a reader who goes away does not kill the program with a force on.
/// First of all in main().
void block_stop_signals();

/// Waits for one of the signals that block_stop_signals() blocked. A second one, a second or more after the first,
/// ends the program at once with exit code 1: by then the hand has been let go, and main hangs.
///
/// Thread  its own; made and destroyed by one thread
class StopSignals {
 public:
  StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  ~StopSignals();

  /// `on_stop` runs once, on the thread of this object, or here when a signal has already come. It must not block.
  void when_requested(std::function<void()> on_stop);
  /// Thread  any
  bool is_requested() const noexcept { return is_requested_.load(std::memory_order_relaxed); }

 private:
  void watch();
  void request();

  std::mutex mutex_;  // protects on_stop_, and is_requested_ against it
  std::function<void()> on_stop_;
  std::atomic<bool> is_requested_{false};
  std::atomic<bool> is_closing_{false};
  std::thread thread_;
};

}  // namespace tandem::client
