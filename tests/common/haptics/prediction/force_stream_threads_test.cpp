// Runs a stream on two threads: one adds and reads samples, the other fits models. A data race is reported by the
// thread sanitizer.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "common/haptics/prediction/force_stream.hpp"

namespace tandem::haptics {
namespace {

TEST(ForceStreamThreads, CoefficientsComeFromAnotherThread) {
  ForceStream stream;
  std::atomic<bool> is_over{false};
  std::thread io([&] {
    while (!is_over) {
      if (!stream.fit()) std::this_thread::yield();
    }
  });
  LocalTime now{};
  // The loop ends after 20 fits have been used, so that the test does not depend on the speed of the other thread.
  for (int k = 0; k < 2'000'000 && stream.figures().fits < 20; ++k) {
    now += std::chrono::milliseconds(5);
    Wrench wrench;
    wrench.f.x() = std::sin(0.1 * k);
    stream.push(now, wrench, k % 1000 == 999);
    ASSERT_TRUE(is_finite(stream.at(now + std::chrono::milliseconds(3))));
  }
  is_over = true;
  io.join();
  EXPECT_GE(stream.figures().fits, 20U);
}

}  // namespace
}  // namespace tandem::haptics
