// See keep_awake.hpp.
#include "common/realtime/keep_awake.hpp"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>

#include "common/base/time.hpp"
#include "common/realtime/realtime.hpp"

namespace tandem::realtime {
namespace {

constexpr Duration kFollowEvery{std::chrono::milliseconds(10)};
/// Of so many such times, for how much others have the processor at most where it is the loop's; for how many it stops otherwise.
constexpr int kJudgeTimes = 10, kStopTimes = 100;
constexpr double kMaxWaiting = 0.5;

/// -1: there is no such thread any more. `stat` is its file in /proc.
int processor_of(int stat) {
  std::array<char, 1024> bytes{};
  const ssize_t count = pread(stat, bytes.data(), bytes.size(), 0);
  if (count <= 0) return -1;
  std::string_view text(bytes.data(), static_cast<std::size_t>(count));
  // After the name, which may hold anything, comes the third value; the processor is the 39th (man 5 proc).
  text.remove_prefix(std::min(text.size(), text.rfind(')') + 1));
  for (int value = 3; value <= 39; ++value) text.remove_prefix(std::min(text.size(), text.find(' ') + 1));
  return text.empty() ? -1 : std::atoi(text.data());
}

/// False: that thread is gone.
bool follow(int stat) {
  const int processor = processor_of(stat);
  if (processor < 0) return false;
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  CPU_SET(static_cast<std::size_t>(processor), &cpus);
  sched_setaffinity(0, sizeof(cpus), &cpus);
  return true;
}

/// How long the calling thread has been ready while others ran; 0 where the kernel does not count it. `schedstat` is its file
/// in /proc. What a host takes is not in it.
Duration waiting_of(int schedstat) {
  std::array<char, 128> bytes{};
  if (pread(schedstat, bytes.data(), bytes.size() - 1, 0) <= 0) return Duration{0};
  char* after_running = nullptr;
  std::strtoll(bytes.data(), &after_running, 10);
  return Duration(std::strtoll(after_running, nullptr, 10));
}

void run_beside(int stat, int schedstat, const std::stop_token& stop) {
  const sched_param parameters{};
  if (sched_setscheduler(0, SCHED_IDLE, &parameters) != 0) return;
  const SteadyClock clock;
  while (true) {
    const LocalTime begin = clock.now();
    const Duration waited_before = waiting_of(schedstat);
    for (int i = 0; i < kJudgeTimes; ++i) {
      if (stop.stop_requested() || !follow(stat)) return;
      const LocalTime end = clock.now() + kFollowEvery;
      while (clock.now() < end) {
      }
    }
    const Duration waited = waiting_of(schedstat) - waited_before;
    if (to_seconds(waited) <= kMaxWaiting * to_seconds(clock.now() - begin)) continue;
    for (int i = 0; i < kStopTimes && !stop.stop_requested(); ++i) std::this_thread::sleep_for(kFollowEvery);
  }
}

bool is_number(const std::filesystem::path& file) {
  std::ifstream stream(file);
  long long value = 0;
  return stream >> value && value > 0;
}

bool is_virtual(const std::filesystem::path& root) {
  std::ifstream cpuinfo(root / "proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    if (line.starts_with("flags")) return (line + ' ').find(" hypervisor ") != std::string::npos;
  }
  return false;
}

}  // namespace

bool gives_idle_to_host(const std::filesystem::path& root) {
  std::string driver;
  std::ifstream(root / "sys/devices/system/cpu/cpuidle/current_driver") >> driver;
  return (driver.empty() || driver == "none") && is_virtual(root);
}

bool has_processor_quota(const std::filesystem::path& root) {
  const std::filesystem::path groups = root / "sys/fs/cgroup";
  // Version 1, as a container sees its own; and version 2, where those above count as well.
  if (is_number(groups / "cpu/cpu.cfs_quota_us")) return true;
  std::ifstream own(root / "proc/self/cgroup");
  for (std::string line; std::getline(own, line);) {
    if (!line.starts_with("0::/")) continue;
    std::filesystem::path group = line.substr(4);
    while (true) {
      if (is_number(groups / group / "cpu.max")) return true;
      if (group.empty()) break;
      group = group.parent_path();
    }
  }
  return false;
}

bool should_keep_awake() {
  return has_realtime_priority() && gives_idle_to_host() && !has_processor_quota();
}

std::jthread keep_awake() {
  const std::string path = "/proc/self/task/" + std::to_string(gettid()) + "/stat";
  const int stat = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (stat < 0) return {};
  return std::jthread([stat](const std::stop_token& stop) {
    const int schedstat = open("/proc/thread-self/schedstat", O_RDONLY | O_CLOEXEC);
    run_beside(stat, schedstat, stop);
    if (schedstat >= 0) close(schedstat);
    close(stat);
  });
}

}  // namespace tandem::realtime
