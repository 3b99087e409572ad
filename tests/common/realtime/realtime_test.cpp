// Tests the periodic timer and the requests for real-time properties. Only counts and lower bounds of times are
// checked, so that the tests do not depend on the speed of the machine.
#include "common/realtime/realtime.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <vector>

namespace tandem::realtime {
namespace {

using ::testing::Contains;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(PeriodicTimer, NeverWakesBeforeItsDeadlineAndDeadlinesAreAPeriodApart) {
  const SteadyClock clock;
  const LocalTime start = clock.now();
  const Duration period = std::chrono::milliseconds(2);
  PeriodicTimer timer(period, start);
  for (int i = 0; i < 20; ++i) {
    const LocalTime deadline = timer.wait();
    EXPECT_GE(clock.now(), deadline);
    EXPECT_EQ((deadline - start) % period, Duration{0});
  }
  EXPECT_EQ(timer.lateness().count(), 20U);
}

TEST(PeriodicTimer, WakesAheadByTheSetTime) {
  const SteadyClock clock;
  const Duration early = std::chrono::microseconds(500);
  PeriodicTimer timer(std::chrono::milliseconds(2), clock.now());
  int ahead = 0;
  for (int i = 0; i < 200; ++i) {
    const LocalTime deadline = timer.wait(early);
    const LocalTime now = clock.now();
    EXPECT_GE(now, deadline - early);
    if (now < deadline) ++ahead;
  }
  EXPECT_GT(ahead, 0) << "the wake-up latency must be measured by then";
}

TEST(PeriodicTimer, ThatSpinsIsNotBeforeItsDeadlineEither) {
  const SteadyClock clock;
  const Duration spin = std::chrono::microseconds(400);
  PeriodicTimer timer(std::chrono::milliseconds(1), clock.now(), spin);
  for (int i = 0; i < 200; ++i) {
    const LocalTime deadline = timer.wait();
    ASSERT_GE(clock.now(), deadline);
  }
}

TEST(PeriodicTimer, LateLoopSkipsMissedTicksInsteadOfABurst) {
  const SteadyClock clock;
  const LocalTime start = clock.now();
  const Duration period = std::chrono::milliseconds(1);
  PeriodicTimer timer(period, start);
  timer.wait();
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  const LocalTime deadline = timer.wait();
  EXPECT_GE(timer.missed(), 28U);
  EXPECT_GE(deadline - start, std::chrono::milliseconds(29));
  // Every deadline must be counted once, as met or as missed.
  EXPECT_EQ(timer.lateness().count() + timer.missed(), static_cast<std::uint64_t>((deadline - start) / period));
}

TEST(PeriodicTimer, WakeUpLaterThanTwentyFiveMillisecondsIsSuspicious) {
  const SteadyClock clock;
  PeriodicTimer timer(std::chrono::milliseconds(100), clock.now() - std::chrono::milliseconds(160));
  timer.wait();  // returns at once: its deadline passed 60 ms ago, which is late but less than a period
  EXPECT_EQ(timer.throttle_suspects(), 1U);
  EXPECT_GE(timer.lateness().max(), std::chrono::milliseconds(60));
}

TEST(PeriodicTimer, RefusesAPeriodOfZero) {
  EXPECT_THROW(PeriodicTimer(Duration{0}, LocalTime{}), std::invalid_argument);
}

TEST(Realtime, RequestingNothingAlwaysSucceeds) {
  EXPECT_THAT(request_realtime(0), SizeIs(0));
}

TEST(Realtime, ImpossibleRequestsAreEachAnsweredByOneLineWithARemedy) {
  // A separate thread makes the request, so that the test program itself keeps its scheduling.
  std::vector<std::string> missing;
  std::thread([&missing] { missing = request_realtime(1000, 100000); }).join();
  EXPECT_THAT(missing, SizeIs(Ge(2U))) << "and where memory may not be locked, a line of that";
  EXPECT_THAT(missing, Contains(HasSubstr("CPU 100000")));
  EXPECT_THAT(missing, Contains(HasSubstr("priority 1000")));
  EXPECT_THAT(missing, Contains(HasSubstr("use a priority from 1 to 99")));
}

/// Exits with 0 if both conditions hold: a request with a priority keeps processors from deep sleep, and a request
/// without priority does not.
[[noreturn]] void request_light_sleep_and_exit() {
  const auto holds_it = [] {
    const std::filesystem::directory_iterator files("/proc/self/fd");
    return std::ranges::any_of(files, [](const auto& file) {
      std::error_code ignored;
      return std::filesystem::read_symlink(file.path(), ignored) == "/dev/cpu_dma_latency";
    });
  };
  request_realtime(0);
  const bool before = holds_it();
  request_realtime(1);
  const bool may = access("/dev/cpu_dma_latency", W_OK) == 0;
  _exit(!before && holds_it() == may ? 0 : 1);
}

TEST(Realtime, ProcessorsDoNotSleepDeeplyOnceThereIsAPriority) {
  // Runs the check in a new process, in which no priority has been requested before.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(request_light_sleep_and_exit(), testing::ExitedWithCode(0), "");
}

TEST(Realtime, ProcessorTimeIsThatOfTheRequestedThread) {
  const Duration before = cpu_time(pthread_self());
  Duration of_sleeper{1};
  std::thread([&of_sleeper] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    of_sleeper = cpu_time(pthread_self());
  }).join();
  EXPECT_LT(of_sleeper, std::chrono::milliseconds(20)) << "it slept";
  while (cpu_time(pthread_self()) - before < std::chrono::milliseconds(20)) {
  }
  EXPECT_GT(usable_cores(), 0U);
}

TEST(Realtime, TheQuotaOfACgroupCountsAsWholeCores) {
  EXPECT_EQ(cores_of_quota("200000 100000"), 2U);
  EXPECT_EQ(cores_of_quota("250000 100000\n"), 3U);
  EXPECT_EQ(cores_of_quota("1000 100000"), 1U);
  for (const char* const text : {"max 100000", "", "200000", "-1 100000", "200000 0", "nan 100000", "cores 2"}) {
    EXPECT_EQ(cores_of_quota(text), std::nullopt) << text;
  }
}

std::size_t pages_in_use() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages;
}

/// Exits with 0 if an allocation beyond a small limit of locked memory still succeeds.
[[noreturn]] void allocate_under_a_small_limit() {
  const rlim_t limit = pages_in_use() * 4096 + (16U << 20U);
  const rlimit limits{limit, limit};
  setrlimit(RLIMIT_MEMLOCK, &limits);
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct none[_LINUX_CAPABILITY_U32S_3] = {};
  syscall(SYS_capset, &header, none);
  request_realtime(1);
  std::vector<char> later(64U << 20U);
  _exit(later.back());
}

TEST(Realtime, AMemoryLimitThatComesLaterDoesNotEndTheProgram) {
  EXPECT_EXIT(allocate_under_a_small_limit(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace tandem::realtime
