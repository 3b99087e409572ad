// What keeps a processor awake: that it gives way, follows and ends; not how much sooner anything wakes up.
#include "common/realtime/keep_awake.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "common/base/time.hpp"

namespace tandem::realtime {
namespace {

/// Thread of this process at the lowest priority; 0: there is none.
pid_t idle_thread() {
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    const pid_t thread = std::stoi(task.path().filename());
    if (sched_getscheduler(thread) == SCHED_IDLE) return thread;
  }
  return 0;
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

template <class Condition>
void wait_until(Condition condition) {
  while (!condition()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST(KeepAwake, IsOfTheLowestPriorityAndFollowsTheThreadThatAskedUntilItIsDestroyed) {
  const std::vector<int> cpus = usable_cpus();
  std::thread([&cpus] {
    std::jthread awake = keep_awake();
    wait_until([] { return idle_thread() != 0; });
    const pid_t thread = idle_thread();
    for (const int cpu : cpus) {
      const cpu_set_t one = only(cpu);
      ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
      wait_until([thread, cpu] { return is_pinned_to(thread, cpu); });
    }
    awake = {};
    EXPECT_EQ(idle_thread(), 0);
  }).join();
}

TEST(KeepAwake, EndsWithTheThreadThatAsked) {
  std::jthread awake;
  std::thread([&awake] { awake = keep_awake(); }).join();
  wait_until([] { return idle_thread() == 0; });
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
  EXPECT_FALSE(gives_idle_to_host(Machine().root())) << "nothing is known";
  EXPECT_TRUE(gives_idle_to_host(Machine().with("fpu hypervisor lahf_lm").with_driver("none").root()));
  EXPECT_TRUE(gives_idle_to_host(Machine().with("fpu hypervisor").root()));
  EXPECT_FALSE(gives_idle_to_host(Machine().with("fpu hypervisor").with_driver("haltpoll").root()));
  EXPECT_FALSE(gives_idle_to_host(Machine().with("fpu lahf_lm").with_driver("none").root()));
}

TEST(KeepAwake, AQuotaOfAGroupOrOfOneAboveItIsSeen) {
  EXPECT_FALSE(has_processor_quota(Machine().root())) << "nothing is known";
  const auto quota = [](const std::string& file, const std::string& text) {
    Machine machine;
    machine.write("proc/self/cgroup", "0::/user.slice/session-1.scope\n");
    return has_processor_quota(machine.write(file, text).root());
  };
  EXPECT_TRUE(quota("sys/fs/cgroup/user.slice/session-1.scope/cpu.max", "150000 100000\n"));
  EXPECT_TRUE(quota("sys/fs/cgroup/user.slice/cpu.max", "50000 100000\n"));
  EXPECT_TRUE(quota("sys/fs/cgroup/cpu.max", "50000 100000\n"));
  EXPECT_FALSE(quota("sys/fs/cgroup/user.slice/cpu.max", "max 100000\n"));
  EXPECT_FALSE(quota("sys/fs/cgroup/system.slice/cpu.max", "50000 100000\n"));
  EXPECT_TRUE(quota("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "50000\n"));
  EXPECT_FALSE(quota("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n"));
}

}  // namespace
}  // namespace tandem::realtime
