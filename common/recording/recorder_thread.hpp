// Writer thread of a recording. It ensures that the recorded thread does not wait for a disk.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "common/base/time.hpp"

namespace tandem::recording {

/// Calls `work` once per period on a thread of normal priority, and a last time when it stops.
class RecorderThread {
 public:
  /// In      work  function to call; must not throw
  RecorderThread(Duration period, std::function<void()> work);
  /// Calls stop().
  ~RecorderThread();
  RecorderThread(const RecorderThread&) = delete;
  RecorderThread& operator=(const RecorderThread&) = delete;

  /// Waits for the last call to end. May be called repeatedly.
  void stop();

 private:
  std::atomic<bool> is_stopping_{false};
  std::thread thread_;
};

}  // namespace tandem::recording
