// See watchdog.hpp.
#include "devices/watchdog.hpp"

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <spawn.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "devices/watchdog_program.hpp"

namespace tandem::devices {
namespace {

constexpr unsigned kUsbTimeout_ms = 20;
constexpr auto kEndsWithin = std::chrono::milliseconds(500);

std::string hex(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) text.append({kDigits[byte >> 4U], kDigits[byte & 15U]});
  return text;
}

/// Descriptors of another process: taken from copies above all of them, so that none is overwritten before it is copied.
class Inherited {
 public:
  Inherited() { posix_spawn_file_actions_init(&actions); }
  ~Inherited() {
    posix_spawn_file_actions_destroy(&actions);
    for (const int copy : copies_) close(copy);
  }
  Inherited(const Inherited&) = delete;
  Inherited& operator=(const Inherited&) = delete;
  bool give(int descriptor, int as) {
    const int copy = fcntl(descriptor, F_DUPFD_CLOEXEC, watchdog_program::kFirstFree);
    if (copy < 0) return false;
    copies_.push_back(copy);
    return posix_spawn_file_actions_adddup2(&actions, copy, as) == 0;
  }
  posix_spawn_file_actions_t actions{};

 private:
  std::vector<int> copies_;
};

/// Of a new session, with none of this program's signals blocked or ignored.
class FreshAttributes {
 public:
  FreshAttributes() {
    posix_spawnattr_init(&attributes);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK);
  }
  ~FreshAttributes() { posix_spawnattr_destroy(&attributes); }
  FreshAttributes(const FreshAttributes&) = delete;
  FreshAttributes& operator=(const FreshAttributes&) = delete;
  posix_spawnattr_t attributes{};
};

}  // namespace

bool say_zero(const ZeroCommand& zero) noexcept {
  if (!zero.usb_endpoint) {
    return write(zero.descriptor, zero.bytes.data(), zero.bytes.size()) == static_cast<ssize_t>(zero.bytes.size());
  }
  usbdevfs_bulktransfer transfer{};
  transfer.ep = *zero.usb_endpoint;
  transfer.len = static_cast<unsigned>(zero.bytes.size());
  transfer.timeout = kUsbTimeout_ms;
  transfer.data = const_cast<std::uint8_t*>(zero.bytes.data());
  return ioctl(zero.descriptor, USBDEVFS_BULK, &transfer) == static_cast<int>(zero.bytes.size());
}

std::filesystem::path Watchdog::default_program() {
  const char* const chosen = std::getenv("TANDEM_WATCHDOG");
  if (chosen != nullptr && *chosen != '\0') return chosen;
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / "tandem-watchdog";
}

Watchdog::Watchdog(int realtime_priority, std::filesystem::path program)
    : program_(std::move(program)), priority_(std::to_string(realtime_priority)) {
  if (access(program_.c_str(), X_OK) != 0) {
    throw std::runtime_error("the watchdog " + program_.string() +
                             " is missing, which takes the force away when this one is stopped or killed; install it "
                             "beside this one, or say where it is by TANDEM_WATCHDOG");
  }
  memory_ = memfd_create("tandem-watchdog", MFD_CLOEXEC);
  void* shared = MAP_FAILED;
  if (memory_ >= 0 && ftruncate(memory_, sizeof(WatchdogBeat)) == 0)
    shared = mmap(nullptr, sizeof(WatchdogBeat), PROT_READ | PROT_WRITE, MAP_SHARED, memory_, 0);
  if (shared == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "memory shared with the watchdog");
  beat_ = new (shared) WatchdogBeat;
}

Watchdog::~Watchdog() {
  release();
  munmap(beat_, sizeof(WatchdogBeat));
  close(memory_);
}

bool Watchdog::watch_over(const ZeroCommand& zero) {
  release();
  if (zero.bytes.empty() || zero.bytes.size() > kMaxZeroBytes) return false;
  int ends[2] = {-1, -1};
  if (pipe2(ends, O_CLOEXEC) != 0) return false;
  lifeline_ = ends[1];
  Inherited inherited;
  const bool are_given = inherited.give(zero.descriptor, watchdog_program::kDevice) &&
                         inherited.give(memory_, watchdog_program::kMemory) &&
                         inherited.give(ends[0], watchdog_program::kLifeline);
  close(ends[0]);
  posix_spawn_file_actions_addclosefrom_np(&inherited.actions, watchdog_program::kFirstFree);
  const FreshAttributes fresh;
  std::string endpoint = zero.usb_endpoint ? std::to_string(*zero.usb_endpoint) : "-", bytes = hex(zero.bytes);
  std::string name = "tandem-watchdog";
  const std::array<char*, 5> arguments{name.data(), priority_.data(), endpoint.data(), bytes.data(), nullptr};
  if (are_given &&
      posix_spawn(&process_, program_.c_str(), &inherited.actions, &fresh.attributes, arguments.data(), environ) == 0)
    return true;
  process_ = -1;
  return false;
}

void Watchdog::release() {
  if (lifeline_ >= 0) close(std::exchange(lifeline_, -1));
  if (process_ > 0) {
    // It ends as soon as its lifeline does; one that is stopped must not hold up the end.
    const auto deadline = std::chrono::steady_clock::now() + kEndsWithin;
    pid_t ended = 0;
    while ((ended = waitpid(process_, nullptr, WNOHANG)) == 0 && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (ended == 0) {
      kill(process_, SIGKILL);
      while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
      }
    }
  }
  process_ = -1;
}

void Watchdog::beat(LocalTime now, bool is_force_on) noexcept {
  beat_->at_ns.store(now.time_since_epoch().count(), std::memory_order_relaxed);
  beat_->is_force_on.store(is_force_on, std::memory_order_release);
}

bool Watchdog::has_let_go() noexcept {
  const std::uint32_t let_go = beat_->let_go.load(std::memory_order_acquire);
  return std::exchange(seen_, let_go) != let_go;
}

}  // namespace tandem::devices
