#include "common/realtime/keep_awake.hpp"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>

#include "common/base/time.hpp"
#include "common/realtime/realtime.hpp"

namespace tandem::realtime {
namespace {

constexpr Duration kFollowEvery{std::chrono::milliseconds(10)};
/// Rule by which the helper makes way for other threads. It measures the load over kJudgeTimes periods of kFollowEvery.
/// If threads other than the helper and the protected thread used more than the fraction kMaxOthers of the processor's
/// time, the helper pauses for kStopTimes periods.
constexpr int kJudgeTimes = 10, kStopTimes = 100;
constexpr double kMaxOthers = 0.5;

// One flag per processor: set while a helper thread keeps the processor awake.
std::array<std::atomic_flag, CPU_SETSIZE> kept_awake{};

/// Returns the processor on which a thread ran last; −1 if the thread has ended. `stat` is its open /proc stat file.
int processor_of(int stat) {
  std::array<char, 1024> bytes{};
  const ssize_t count = pread(stat, bytes.data(), bytes.size(), 0);
  if (count <= 0) return -1;
  std::string_view text(bytes.data(), static_cast<std::size_t>(count));
  // The file contains values separated by spaces (man 5 proc). The processor is the 39th value. Counting starts at the
  // 3rd value, after the last ')', because the 2nd value is the thread's name in parentheses, which may contain spaces.
  text.remove_prefix(std::min(text.size(), text.rfind(')') + 1));
  for (int value = 3; value <= 39; ++value) text.remove_prefix(std::min(text.size(), text.find(' ') + 1));
  return text.empty() ? -1 : std::atoi(text.data());
}

/// Returns two times from the /proc schedstat file of a thread: the time in which the thread ran, and the time in which
/// it was ready to run while other threads ran (0 if the kernel does not count it). Neither includes time in which the
/// host suspended the virtual processor.
std::array<Duration, 2> times_of(int schedstat) {
  std::array<char, 128> bytes{};
  if (pread(schedstat, bytes.data(), bytes.size() - 1, 0) <= 0) return {};
  char* after_running = nullptr;
  const Duration running(std::strtoll(bytes.data(), &after_running, 10));
  return {running, Duration(std::strtoll(after_running, nullptr, 10))};
}

/// Pins the calling thread to the processor and returns true. Returns false if another helper already keeps that
/// processor awake.
bool claim(int processor) {
  const auto index = static_cast<std::size_t>(processor);
  if (processor >= CPU_SETSIZE || kept_awake[index].test_and_set()) return false;
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  CPU_SET(index, &cpus);
  sched_setaffinity(0, sizeof(cpus), &cpus);
  return true;
}

/// Loop of the helper thread. `stat` and `schedstat` are open /proc files of the protected thread, whose processor must
/// stay awake.
void run_beside(int stat, int schedstat, int own_schedstat, const std::weak_ptr<const void>& is_wanted) {
  const SteadyClock clock;
  const auto others_so_far = [=] { return times_of(own_schedstat)[1] - times_of(schedstat)[0]; };
  int taken = -1, times = 0;
  LocalTime begin;
  Duration others_before{0};
  while (!is_wanted.expired()) {
    const int processor = processor_of(stat);
    if (processor < 0) break;
    if (processor != taken) {
      if (taken >= 0) kept_awake[static_cast<std::size_t>(taken)].clear();
      taken = claim(processor) ? processor : -1;
      times = 0;
    }
    if (taken < 0) {
      std::this_thread::sleep_for(kFollowEvery);
      continue;
    }
    if (times == 0) {
      begin = clock.now();
      others_before = others_so_far();
    }
    const LocalTime end = clock.now() + kFollowEvery;
    while (clock.now() < end) {
    }
    times = (times + 1) % kJudgeTimes;
    if (times != 0) continue;
    const double others = to_seconds(others_so_far() - others_before) / to_seconds(clock.now() - begin);
    for (int i = 0; others > kMaxOthers && i < kStopTimes && !is_wanted.expired(); ++i) {
      std::this_thread::sleep_for(kFollowEvery);
    }
  }
  if (taken >= 0) kept_awake[static_cast<std::size_t>(taken)].clear();
}

int opened(const std::string& file) {
  return open(file.c_str(), O_RDONLY | O_CLOEXEC);
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
  std::ifstream own(root / "proc/self/cgroup");
  for (std::string line; std::getline(own, line);) {
    // A line of the file contains number, controllers and path of a group. In cgroup version 2 the list of controllers
    // is empty. The quotas of all groups above the named one apply to this process as well.
    const std::size_t colon = line.find(':'), slash = line.find(":/");
    if (slash == std::string::npos) continue;
    const std::string controllers = ',' + line.substr(colon + 1, std::max(colon + 1, slash) - colon - 1) + ',';
    const bool is_second = controllers == ",,";
    if (!is_second && controllers.find(",cpu,") == std::string::npos) continue;
    const std::filesystem::path top = root / (is_second ? "sys/fs/cgroup" : "sys/fs/cgroup/cpu");
    std::filesystem::path group = line.substr(slash + 2);
    while (true) {
      if (is_number(top / group / (is_second ? "cpu.max" : "cpu.cfs_quota_us"))) return true;
      if (group.empty()) break;
      group = group.parent_path();
    }
  }
  return false;
}

bool should_keep_awake() {
  return has_realtime_priority() && gives_idle_to_host() && !has_processor_quota();
}

std::shared_ptr<const void> keep_awake() {
  const std::string thread = "/proc/self/task/" + std::to_string(gettid());
  const int stat = opened(thread + "/stat"), schedstat = opened(thread + "/schedstat");
  const auto close_files = [stat, schedstat] {
    if (stat >= 0) close(stat);
    if (schedstat >= 0) close(schedstat);
  };
  const auto wanted = std::make_shared<const char>();
  try {
    if (stat < 0) throw std::system_error(errno, std::generic_category());
    // The helper is detached, because its low priority (SCHED_IDLE) leaves it almost no time while other threads are
    // busy. Joining it could therefore take a second.
    std::thread([stat, schedstat, close_files, is_wanted = std::weak_ptr<const void>(wanted)] {
      const sched_param parameters{};
      const int own_schedstat = opened("/proc/thread-self/schedstat");
      if (sched_setscheduler(0, SCHED_IDLE, &parameters) == 0) run_beside(stat, schedstat, own_schedstat, is_wanted);
      if (own_schedstat >= 0) close(own_schedstat);
      close_files();
    }).detach();
  } catch (const std::system_error&) {
    close_files();
    return nullptr;
  }
  return wanted;
}

}  // namespace tandem::realtime
