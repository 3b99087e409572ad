// Linux only: the loops use SCHED_FIFO, mlockall and sleeps until absolute times.
#include "common/realtime/realtime.hpp"

#include <fcntl.h>
#include <linux/capability.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <system_error>

namespace tandem::realtime {
namespace {

constexpr std::size_t kPrefaultedStackBytes = 256U * 1024U;
constexpr std::size_t kPageBytes = 4096;
// A wake-up that is later than this suggests real-time throttling: by default the kernel suspends real-time threads for
// 50 ms of each second (sched_rt_runtime_us is 950000 of 1000000). Half of these 50 ms is well above the delays of a
// busy machine.
constexpr Duration kThrottleLateness{std::chrono::milliseconds(25)};

/// Time constant of the running mean of the wake-up delay, in wake-ups.
constexpr int kWakingMean = 64;

std::string not_granted(const std::string& what, int error, const std::string& remedy) {
  return what + " not granted (" + std::generic_category().message(error) + "): " + remedy;
}

/// Returns the path of this process's cgroup (v2), relative to the root of the cgroup file system; empty if there is
/// none.
std::filesystem::path own_cgroup() {
  std::ifstream file("/proc/self/cgroup");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("0::/")) return std::filesystem::path(line.substr(4)).lexically_normal();
  }
  return {};
}

void request_priority(int priority, std::vector<std::string>& missing) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (error == 0) return;
  const std::string what = "real-time priority " + std::to_string(priority);
  if (error == EPERM) {
    missing.push_back(not_granted(what, error,
                                  "raise the limit shown by 'ulimit -r' (a line '<user> - rtprio 95' in "
                                  "/etc/security/limits.conf, then log in again) or give the program CAP_SYS_NICE; in "
                                  "a container also check sysctl kernel.sched_rt_runtime_us"));
  } else {
    missing.push_back(not_granted(what, error, "use a priority from 1 to 99, or 0 for the normal scheduler"));
  }
}

// Touches one byte per page below the current frame, so that the stack pages are resident before the loop uses them.
[[gnu::noinline]] void prefault_stack() {
  std::byte pages[kPrefaultedStackBytes];
  volatile std::byte* const touched = pages;
  for (std::size_t i = 0; i < kPrefaultedStackBytes; i += kPageBytes) touched[i] = std::byte{0};
}

bool may_lock_all_memory() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> held{};
  const bool is_known = syscall(SYS_capget, &header, held.data()) == 0;
  if (is_known && (held[0].effective & (1U << CAP_IPC_LOCK)) != 0) return true;
  rlimit limit{};
  return getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY;
}

void request_locked_memory(std::vector<std::string>& missing) {
  // If the amount of locked memory is limited, only the existing memory is locked. With MCL_FUTURE, an allocation
  // beyond the limit would fail and end the program while it displays a force.
  const bool may_lock_all = may_lock_all_memory();
  const int result = mlockall(may_lock_all ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT);
  if (result != 0 || !may_lock_all) {
    missing.push_back(not_granted(result != 0 ? "locked memory" : "locked memory for later allocations",
                                  result != 0 ? errno : EPERM,
                                  "raise the limit shown by 'ulimit -l' (a line '<user> - memlock unlimited' in "
                                  "/etc/security/limits.conf, then log in again) or give the program CAP_IPC_LOCK"));
  }
  prefault_stack();
}

/// Returns whether the kernel uses idle states of the processor. Some of them may have a long wake-up latency.
bool has_deep_sleep() {
  std::string driver;
  std::ifstream("/sys/devices/system/cpu/cpuidle/current_driver") >> driver;
  return !driver.empty() && driver != "none";
}

void request_light_sleep(std::vector<std::string>& missing) {
  // The request is effective as long as the file is open. Only the first call opens the file; later calls return the
  // stored result. The file stays open until the program ends.
  static const int error = [] {
    const int file = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    if (file < 0) return errno;
    const std::int32_t latency_us = 0;
    return write(file, &latency_us, sizeof(latency_us)) == sizeof(latency_us) ? 0 : EIO;
  }();
  if (error == 0 || !has_deep_sleep()) return;
  missing.push_back(not_granted(
      "processors that sleep lightly", error,
      "allow the user at the machine to write /dev/cpu_dma_latency (deploy/udev/70-tandem.rules), or start as root"));
}

void request_cpu(int cpu, std::vector<std::string>& missing) {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  int error = EINVAL;
  if (cpu < CPU_SETSIZE) {
    CPU_SET(static_cast<std::size_t>(cpu), &cpus);
    error = pthread_setaffinity_np(pthread_self(), sizeof(cpus), &cpus);
  }
  if (error == 0) return;
  missing.push_back(not_granted("CPU " + std::to_string(cpu), error,
                                "choose one of those that 'nproc' counts and 'taskset -cp $$' lists, or do not pin"));
}

timespec timespec_of(LocalTime time) {
  constexpr Duration::rep kSecond = 1'000'000'000;
  const Duration::rep ns = time.time_since_epoch().count();
  timespec result{};
  result.tv_sec = static_cast<time_t>(ns / kSecond);
  result.tv_nsec = static_cast<long>(ns % kSecond);
  return result;
}

}  // namespace

std::vector<std::string> request_realtime(int priority, int cpu) {
  std::vector<std::string> missing;
  if (priority > 0) request_locked_memory(missing);
  if (priority > 0) request_light_sleep(missing);
  if (cpu >= 0) request_cpu(cpu, missing);
  if (priority != 0) request_priority(priority, missing);
  return missing;
}

void drop_realtime() {
  set_priority(pthread_self(), 0);
}

bool has_realtime_priority() {
  int policy = SCHED_OTHER;
  sched_param parameters{};
  if (pthread_getschedparam(pthread_self(), &policy, &parameters) != 0) return false;
  return policy == SCHED_FIFO || policy == SCHED_RR;
}

std::optional<std::size_t> cores_of_quota(const std::string& cpu_max) {
  std::istringstream in(cpu_max);
  double quota_us = 0, period_us = 0;
  if (!(in >> quota_us >> period_us) || !(quota_us > 0) || !(period_us > 0)) return std::nullopt;
  return static_cast<std::size_t>(std::clamp(std::ceil(quota_us / period_us), 1.0, 65536.0));
}

std::size_t usable_cores() {
  cpu_set_t cpus;
  const bool is_known = sched_getaffinity(0, sizeof(cpus), &cpus) == 0;
  std::size_t cores = is_known ? std::max(1U, static_cast<unsigned>(CPU_COUNT(&cpus))) : 1;
  const std::filesystem::path root = "/sys/fs/cgroup";
  for (std::filesystem::path group = root / own_cgroup();; group = group.parent_path()) {
    std::ifstream file(group / "cpu.max");
    std::string text;
    std::getline(file, text);
    if (const auto quota = cores_of_quota(text)) cores = std::min(cores, *quota);
    if (group == root || group == group.parent_path()) return cores;
  }
}

Duration cpu_time(pthread_t thread) {
  clockid_t clock{};
  timespec time{};
  if (pthread_getcpuclockid(thread, &clock) != 0 || clock_gettime(clock, &time) != 0) return Duration{0};
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

bool set_priority(pthread_t thread, int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return pthread_setschedparam(thread, priority > 0 ? SCHED_FIFO : SCHED_OTHER, &parameters) == 0;
}

PeriodicTimer::PeriodicTimer(Duration period, LocalTime start, Duration spin)
    : period_(period), next_(start), spin_(spin) {
  if (period <= Duration{0}) throw std::invalid_argument("the period of a timer must be above 0");
}

LocalTime PeriodicTimer::wait(Duration early) {
  const SteadyClock clock;
  next_ += period_;
  const Duration behind = clock.now() - next_;
  if (behind > period_) {
    const auto skipped = behind / period_;
    missed_ += static_cast<std::uint64_t>(skipped);
    next_ += skipped * period_;
  }
  if (clock.now() + early < next_) {
    const Duration ahead = std::max(early, spin_);
    const LocalTime end = next_ - std::min(ahead, 2 * waking_);
    if (clock.now() < end) {
      const timespec until = timespec_of(end);
      while (clock_nanosleep(CLOCK_BOOTTIME, TIMER_ABSTIME, &until, nullptr) == EINTR) {
      }
      waking_ += (std::min(clock.now() - end, ahead) - waking_) / kWakingMean;
    }
    while (clock.now() + early < next_) {
    }
  }
  const Duration late = clock.now() - next_;
  lateness_.record(late);
  if (late > kThrottleLateness) ++throttle_suspects_;
  return next_;
}

}  // namespace tandem::realtime
