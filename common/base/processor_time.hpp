// Processor time of the calling thread.
#pragma once

#include <ctime>

#include "common/base/time.hpp"

namespace tandem {

/// Returns the CPU time that this thread has used. Time in which it is ready but not running does not count.
inline Duration processor_time() noexcept {
  std::timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace tandem
