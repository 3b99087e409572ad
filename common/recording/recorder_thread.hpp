// The thread that writes a recording, so that who is recorded waits for no disk.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "common/base/time.hpp"

namespace tandem::recording {

/// Calls `work` once a period on a thread of normal priority, and once more when it stops.
class RecorderThread {
 public:
  /// In      work  must not throw
  RecorderThread(Duration period, std::function<void()> work);
  /// As stop().
  ~RecorderThread();
  RecorderThread(const RecorderThread&) = delete;
  RecorderThread& operator=(const RecorderThread&) = delete;

  /// Waits for the last call. Idempotent.
  void stop();

 private:
  std::atomic<bool> is_stopping_{false};
  std::thread thread_;
};

}  // namespace tandem::recording
