// Tests helper threads that keep a processor awake: they must yield to other threads, follow the protected thread, and
// end. Their effect on the wake-up latency is not tested.
#include "common/realtime/keep_awake.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/base/time.hpp"
#include "tests/support/needs.hpp"

namespace tandem::realtime {
namespace {

/// Returns the threads of this process with the priority SCHED_IDLE.
std::vector<pid_t> idle_threads() {
  std::vector<pid_t> result;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    const pid_t thread = std::stoi(task.path().filename());
    if (sched_getscheduler(thread) == SCHED_IDLE) result.push_back(thread);
  }
  return result;
}

bool may_be_idle() {
  bool may = false;
  std::thread([&may] {
    const sched_param parameters{};
    may = sched_getscheduler(0) != SCHED_IDLE && sched_setscheduler(0, SCHED_IDLE, &parameters) == 0;
  }).join();
  return may;
}

cpu_set_t only(int cpu) {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  CPU_SET(static_cast<std::size_t>(cpu), &cpus);
  return cpus;
}

bool is_pinned_to(pid_t thread, int cpu) {
  cpu_set_t cpus;
  const cpu_set_t wanted = only(cpu);
  return sched_getaffinity(thread, sizeof(cpus), &cpus) == 0 && CPU_EQUAL(&cpus, &wanted);
}

std::vector<int> usable_cpus() {
  cpu_set_t cpus;
  std::vector<int> result;
  sched_getaffinity(0, sizeof(cpus), &cpus);
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &cpus)) result.push_back(cpu);
  }
  return result;
}

/// Waits up to 30 s for the condition, which suffices even on a busy processor. Returns whether it became true.
template <class Condition>
bool is_in_time(Condition condition) {
  const SteadyClock clock;
  for (const LocalTime end = clock.now() + std::chrono::seconds(30); clock.now() < end;) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

bool is_nobody_idle() {
  return is_in_time([] { return idle_threads().empty(); });
}

TEST(KeepAwake, IsOfTheLowestPriorityAndFollowsTheThreadThatAskedUntilNobodyHoldsIt) {
  TANDEM_NEEDS_OF_MACHINE(may_be_idle(), "the scheduling policy SCHED_IDLE");
  ASSERT_TRUE(is_nobody_idle());
  const std::vector<int> cpus = usable_cpus();
  std::thread([&cpus] {
    std::shared_ptr<const void> awake = keep_awake();
    ASSERT_TRUE(is_in_time([] { return idle_threads().size() == 1; }));
    const pid_t thread = idle_threads().front();
    for (const int cpu : {cpus.front(), cpus.back()}) {
      const cpu_set_t one = only(cpu);
      ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
      EXPECT_TRUE(is_in_time([thread, cpu] { return is_pinned_to(thread, cpu); }));
    }
    awake = nullptr;
    EXPECT_TRUE(is_nobody_idle());
  }).join();
}

TEST(KeepAwake, EndsWithTheThreadThatRequestedIt) {
  TANDEM_NEEDS_OF_MACHINE(may_be_idle(), "the scheduling policy SCHED_IDLE");
  std::shared_ptr<const void> awake;
  std::thread([&awake] { awake = keep_awake(); }).join();
  EXPECT_TRUE(is_nobody_idle());
}

TEST(KeepAwake, OfTwoBesideAThreadOneIsOnItsProcessor) {
  TANDEM_NEEDS_OF_MACHINE(may_be_idle(), "the scheduling policy SCHED_IDLE");
  const std::vector<int> cpus = usable_cpus();
  TANDEM_NEEDS_OF_MACHINE(cpus.size() >= 2, "two processors");
  std::thread([cpu = cpus.front()] {
    std::shared_ptr<const void> first = keep_awake(), second = keep_awake();
    const cpu_set_t one = only(cpu);
    ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
    const auto on_it = [cpu] {
      return std::ranges::count_if(idle_threads(), [cpu](pid_t thread) { return is_pinned_to(thread, cpu); });
    };
    EXPECT_TRUE(is_in_time([&on_it] { return idle_threads().size() == 2 && on_it() > 0; }));
    std::this_thread::sleep_for(std::chrono::seconds(3));  // long enough for the second helper to check its processor
    EXPECT_EQ(on_it(), 1);
    first = second = nullptr;
    EXPECT_TRUE(is_nobody_idle());
  }).join();
}

class Machine {
 public:
  Machine() { std::filesystem::create_directories(root_ / "sys/devices/system/cpu/cpuidle"); }
  ~Machine() { std::filesystem::remove_all(root_); }
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;
  const std::filesystem::path& root() const { return root_; }

  Machine& with(const std::string& flags) {
    return write("proc/cpuinfo", "processor\t: 0\nflags\t\t: " + flags + "\n");
  }
  Machine& with_driver(const std::string& name) {
    return write("sys/devices/system/cpu/cpuidle/current_driver", name + "\n");
  }

  Machine& write(const std::string& file, const std::string& text) {
    std::filesystem::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
    return *this;
  }

 private:
  std::filesystem::path root_ = std::filesystem::temp_directory_path() / ("keep_awake" + std::to_string(getpid()));
};

TEST(KeepAwake, AHostTakesIdleProcessorsOfAVirtualMachineWithoutAnIdleDriver) {
  EXPECT_FALSE(gives_idle_to_host(Machine().root())) << "the system has no information";
  EXPECT_TRUE(gives_idle_to_host(Machine().with("fpu hypervisor lahf_lm").with_driver("none").root()));
  EXPECT_TRUE(gives_idle_to_host(Machine().with("fpu hypervisor").root()));
  EXPECT_FALSE(gives_idle_to_host(Machine().with("fpu hypervisor").with_driver("haltpoll").root()));
  EXPECT_FALSE(gives_idle_to_host(Machine().with("fpu lahf_lm").with_driver("none").root()));
}

TEST(KeepAwake, AQuotaOfAGroupOrOfOneAboveItIsSeen) {
  EXPECT_FALSE(has_processor_quota(Machine().root())) << "the system has no information";
  const auto quota = [](const std::string& file, const std::string& text) {
    Machine machine;
    machine.write("proc/self/cgroup", "4:cpu,cpuacct:/docker/1\n2:memory:/docker/1\n0::/user.slice/session-1.scope\n");
    return has_processor_quota(machine.write(file, text).root());
  };
  EXPECT_TRUE(quota("sys/fs/cgroup/user.slice/session-1.scope/cpu.max", "150000 100000\n"));
  EXPECT_TRUE(quota("sys/fs/cgroup/user.slice/cpu.max", "50000 100000\n"));
  EXPECT_TRUE(quota("sys/fs/cgroup/cpu.max", "50000 100000\n"));
  EXPECT_FALSE(quota("sys/fs/cgroup/user.slice/cpu.max", "max 100000\n"));
  EXPECT_FALSE(quota("sys/fs/cgroup/system.slice/cpu.max", "50000 100000\n"));
  EXPECT_TRUE(quota("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "50000\n"));
  EXPECT_TRUE(quota("sys/fs/cgroup/cpu/docker/1/cpu.cfs_quota_us", "50000\n"));
  EXPECT_FALSE(quota("sys/fs/cgroup/cpu/docker/2/cpu.cfs_quota_us", "50000\n"));
  EXPECT_FALSE(quota("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n"));
}

}  // namespace
}  // namespace tandem::realtime
