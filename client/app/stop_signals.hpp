// Handles stop signals on a separate thread, for programs that display forces. The main thread writes files and may
// block for any time (a pipe, a remote disk). The signal thread writes nothing, so it can always end the force.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

namespace tandem::client {

/// Prepares the signals for StopSignals. Must be the first call in main().
/// * Blocks SIGINT, SIGTERM and SIGQUIT for this thread and the threads that it starts. Blocks SIGHUP as well, unless
///   it is ignored (nohup).
/// * Ignores SIGPIPE. Otherwise the program would end, with a force displayed, when the reader of its output ends.
void block_stop_signals();

/// Waits for one of the signals that block_stop_signals() has blocked. A second signal ends the program at once with
/// exit code 1, if it arrives at least a second after the first. By then the force has been ramped down, so this end is
/// safe; only the main thread can still be blocked.
///
/// Thread  starts a thread; constructed and destroyed by the same thread
class StopSignals {
 public:
  StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  ~StopSignals();

  /// Sets the function that is called once when a signal arrives. The signal thread calls it. If a signal has arrived
  /// before, when_requested() itself calls it. `on_stop` must not block.
  void when_requested(std::function<void()> on_stop);
  /// Thread  any
  bool is_requested() const noexcept { return is_requested_.load(std::memory_order_relaxed); }

 private:
  void watch();
  void request();

  std::mutex mutex_;  // protects on_stop_; makes the change of is_requested_ and the call of on_stop_ atomic
  std::function<void()> on_stop_;
  std::atomic<bool> is_requested_{false};
  std::atomic<bool> is_closing_{false};
  std::thread thread_;
};

}  // namespace tandem::client
