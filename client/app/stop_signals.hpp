// Handles stop signals on a separate thread, for programs that display forces. Main also writes files, which may block
// without limit (a pipe, a remote disk). The signal thread writes nothing, so that it can always end the force.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

namespace tandem::client {

/// Blocks SIGINT, SIGTERM, SIGQUIT and SIGHUP for this thread and the threads that it starts. SIGHUP is not blocked if
/// it is ignored (nohup). SIGPIPE is ignored: otherwise the exit of a program that reads our output would end this
/// program while a force is displayed. Must be the first call in main().
void block_stop_signals();

/// Waits for one of the signals that block_stop_signals() blocked. A second signal, at least a second after the first,
/// ends the program at once with exit code 1. By then the force has been ramped down, so only main can still be
/// blocked.
///
/// Thread  starts a thread; constructed and destroyed by the same thread
class StopSignals {
 public:
  StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  ~StopSignals();

  /// Sets the function that is called once when a signal arrives. It is called on the signal thread, or by this call if
  /// a signal has already arrived. It must not block.
  void when_requested(std::function<void()> on_stop);
  /// Thread  any
  bool is_requested() const noexcept { return is_requested_.load(std::memory_order_relaxed); }

 private:
  void watch();
  void request();

  std::mutex mutex_;  // protects on_stop_, and makes the change of is_requested_ and the call of on_stop_ one operation
  std::function<void()> on_stop_;
  std::atomic<bool> is_requested_{false};
  std::atomic<bool> is_closing_{false};
  std::thread thread_;
};

}  // namespace tandem::client
