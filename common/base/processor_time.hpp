// Processor time of the calling thread.
#pragma once

#include <ctime>

#include "common/base/time.hpp"

namespace tandem {

/// Returns the CPU time that the calling thread has used. Time in which the thread was ready but not running is not
/// included.
inline Duration processor_time() noexcept {
  std::timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace tandem
