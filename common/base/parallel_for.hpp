// Parallel loop over independent items, used for slow preparations when a scene is loaded.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace tandem {

/// Calls work(i) once for each i below `count`, in any order. The calls run on `threads` threads, of which the calling
/// thread is one. Returns when all calls have ended. If a call throws, no further call begins, and the first exception
/// is rethrown to the caller.
///
/// In      threads  number of threads, ≥ 1; more than `count` threads are never used
///         done     function done(i), called after each item that the calling thread has processed (not after
///                  items of the other threads)
/// Thread  any except a 1 kHz thread, because it starts threads and waits for them
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
  const auto run_items = [&](const auto& after) {
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
      while (helpers.size() + 1 < std::min(most, count))
        helpers.emplace_back([&run_items] { run_items([](std::size_t) {}); });
    } catch (...) {
      fail();
    }
    run_items(done);
  }
  if (failure) std::rethrow_exception(failure);
}

template <typename Work>
void parallel_for(int threads, std::size_t count, const Work& work) {
  parallel_for(threads, count, work, [](std::size_t) {});
}

}  // namespace tandem
