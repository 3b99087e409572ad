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

namespace tandem::realtime {
namespace {

constexpr Duration kFollowEvery{std::chrono::milliseconds(10)};

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

void run_beside(int stat, const std::stop_token& stop) {
  const sched_param parameters{};
  if (sched_setscheduler(0, SCHED_IDLE, &parameters) != 0) return;
  const SteadyClock clock;
  LocalTime next{};
  while (!stop.stop_requested()) {
    if (clock.now() < next) continue;
    next = clock.now() + kFollowEvery;
    const int processor = processor_of(stat);
    if (processor < 0) return;
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<std::size_t>(processor), &cpus);
    sched_setaffinity(0, sizeof(cpus), &cpus);
  }
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

std::jthread keep_awake() {
  const std::string path = "/proc/self/task/" + std::to_string(gettid()) + "/stat";
  const int stat = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (stat < 0) return {};
  return std::jthread([stat](const std::stop_token& stop) {
    run_beside(stat, stop);
    close(stat);
  });
}

}  // namespace tandem::realtime
