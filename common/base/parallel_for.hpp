// The same work on many things, by all processors: what is slow to make when a scene is loaded.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace tandem {

/// Calls work(i) once for each i below `count`, in any order, on `threads` threads, the calling one among them, and returns when all
/// is done. What the first of them throws is thrown here; what is not begun then, is not done.
///
/// In      threads  ≥ 1; no more are begun than there is work for
///         done     called on the calling thread with the i that it has done
/// Thread  any, but not one of 1 kHz: threads are begun and waited for
template <typename Work, typename Done>
void parallel_for(int threads, std::size_t count, const Work& work, const Done& done) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_lock;
  const auto fail = [&] {
    next = count;
    const std::scoped_lock lock(failure_lock);
    if (!failure) failure = std::current_exception();
  };
  const auto take = [&](const auto& after) {
    try {
      for (std::size_t i = next++; i < count; i = next++) {
        work(i);
        after(i);
      }
    } catch (...) {
      fail();
    }
  };
  {
    const auto most = static_cast<std::size_t>(std::max(threads, 1));
    std::vector<std::jthread> helpers;
    try {
      while (helpers.size() + 1 < std::min(most, count)) helpers.emplace_back([&take] { take([](std::size_t) {}); });
    } catch (...) {
      fail();
    }
    take(done);
  }
  if (failure) std::rethrow_exception(failure);
}

template <typename Work>
void parallel_for(int threads, std::size_t count, const Work& work) {
  parallel_for(threads, count, work, [](std::size_t) {});
}

}  // namespace tandem
