// Writer thread of a recording, so that the recorded thread need not wait for a disk.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "common/base/time.hpp"

namespace tandem::recording {

/// Calls `work` once per period on a thread of normal priority. When the object is stopped, calls it one last time.
class RecorderThread {
 public:
  /// In      work  function to call; must not throw
  RecorderThread(Duration period, std::function<void()> work);
  /// Calls stop().
  ~RecorderThread();
  RecorderThread(const RecorderThread&) = delete;
  RecorderThread& operator=(const RecorderThread&) = delete;

  /// Stops the thread after a last call of `work`, and waits for it. May be called repeatedly.
  void stop();

 private:
  std::atomic<bool> is_stopping_{false};
  std::thread thread_;
};

}  // namespace tandem::recording
