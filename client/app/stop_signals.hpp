// Thread for the signals of a program that moves a hand. Main also writes files, which may block without limit (a pipe,
// a remote disk). The thread that receives the signals must never write, otherwise the force could not be ended.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

namespace tandem::client {

/// Blocks SIGINT, SIGTERM, SIGQUIT and SIGHUP for this thread and those it starts; SIGHUP not if it is ignored (nohup).
/// Ignores SIGPIPE, so that a reader's exit does not end the program with a force applied. Call first in main().
void block_stop_signals();

/// Waits for one of the signals that block_stop_signals() blocked. A second signal, at least a second after the first,
/// ends the program at once with exit code 1: by then the force has been ramped down, and main is blocked.
///
/// Thread  its own; constructed and destroyed by one thread
class StopSignals {
 public:
  StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  ~StopSignals();

  /// Sets `on_stop`, which runs once, on this object's thread, or here if a signal has already arrived. It must not
  /// block.
  void when_requested(std::function<void()> on_stop);
  /// Thread  any
  bool is_requested() const noexcept { return is_requested_.load(std::memory_order_relaxed); }

 private:
  void watch();
  void request();

  std::mutex mutex_;  // protects on_stop_, and orders its calls with changes of is_requested_
  std::function<void()> on_stop_;
  std::atomic<bool> is_requested_{false};
  std::atomic<bool> is_closing_{false};
  std::thread thread_;
};

}  // namespace tandem::client
