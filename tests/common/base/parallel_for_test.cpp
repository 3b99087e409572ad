#include "common/base/parallel_for.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace tandem {
namespace {

TEST(ParallelFor, DoesEachOnceWithAnyNumberOfThreads) {
  for (const int threads : {1, 2, 7}) {
    for (const std::size_t count : {0, 1, 3, 1000}) {
      std::vector<std::atomic<int>> times(count);
      parallel_for(threads, count, [&](std::size_t i) { ++times[i]; });
      for (const auto& each : times) EXPECT_EQ(each, 1);
    }
  }
}

TEST(ParallelFor, TheCallingThreadReportsItsWorkOnThatThread) {
  const auto caller = std::this_thread::get_id();
  std::vector<std::thread::id> by(500);
  std::vector<char> is_called(by.size());
  parallel_for(
      3, by.size(), [&](std::size_t i) { by[i] = std::this_thread::get_id(); },
      [&](std::size_t i) {
        EXPECT_EQ(std::this_thread::get_id(), caller);
        is_called[i] = 1;
      });
  for (std::size_t i = 0; i < by.size(); ++i) EXPECT_EQ(is_called[i] != 0, by[i] == caller);
}

// Fails if the loop continues after an exception: the items after the tenth are slow and would take ten seconds in
// total.
TEST(ParallelFor, RethrowsAnExceptionAndStartsNoFurtherWork) {
  constexpr std::size_t kCount = 1'000'000;
  for (const int threads : {1, 4}) {
    std::atomic<std::size_t> done{0};
    const auto work = [&](std::size_t i) {
      if (i == 10) throw std::runtime_error("the tenth");
      ++done;
      if (i > 10) std::this_thread::sleep_for(std::chrono::microseconds(10));
    };
    EXPECT_THROW(parallel_for(threads, kCount, work), std::runtime_error);
    EXPECT_LT(done, kCount / 2);
  }
}

}  // namespace
}  // namespace tandem
