#include "devices/watchdog.hpp"

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <spawn.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <new>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "common/base/folders.hpp"
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

/// Descriptors that a child process inherits under fixed numbers. Each descriptor is first copied to a number above all
/// fixed numbers. Otherwise the copy of one descriptor could overwrite another that is not copied yet.
class Inherited {
 public:
  Inherited() { posix_spawn_file_actions_init(&actions); }
  ~Inherited() {
    posix_spawn_file_actions_destroy(&actions);
    for (const int copy : copies_) close(copy);
  }
  Inherited(const Inherited&) = delete;
  Inherited& operator=(const Inherited&) = delete;
  bool add(int descriptor, int as) {
    const int copy = fcntl(descriptor, F_DUPFD_CLOEXEC, watchdog_program::kFirstFree);
    if (copy < 0) return false;
    copies_.push_back(copy);
    return posix_spawn_file_actions_adddup2(&actions, copy, as) == 0;
  }
  posix_spawn_file_actions_t actions{};

 private:
  std::vector<int> copies_;
};

/// Attributes that start a process in a new session with no signal blocked.
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

bool send_zero(const ZeroCommand& zero) noexcept {
  if (!zero.usb_endpoint) {
    const std::size_t size = zero.bytes.size();
    ssize_t count = ::send(zero.descriptor, zero.bytes.data(), size, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (count < 0 && errno == ENOTSOCK) count = write(zero.descriptor, zero.bytes.data(), size);
    return count == static_cast<ssize_t>(size);
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
  return program_folder() / "tandem-watchdog";
}

Watchdog::Watchdog(int realtime_priority, std::filesystem::path program)
    : program_(std::move(program)), priority_(std::to_string(realtime_priority)) {
  if (access(program_.c_str(), X_OK) != 0) {
    throw std::runtime_error("the watchdog " + program_.string() +
                             " is missing; it removes the force when this program is stopped or killed. Install it "
                             "beside this program, or give its path by TANDEM_WATCHDOG");
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
  if (zero.bytes.empty() || zero.bytes.size() > kMaxFrameBytes) return false;
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) != 0) return false;
  lifeline_ = ends[1];
  zero_ = zero;
  beat_->is_in_frame.store(false, std::memory_order_relaxed);
  Inherited inherited;
  const bool are_given = inherited.add(zero.descriptor, watchdog_program::kDevice) &&
                         inherited.add(memory_, watchdog_program::kMemory) &&
                         inherited.add(ends[0], watchdog_program::kOwner);
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
  if (process_ > 0) await_end();
  forget_ended();
}

void Watchdog::await_end() {
  kill(process_, SIGCONT);  // a stopped watchdog could not write zero
  const auto deadline = std::chrono::steady_clock::now() + kEndsWithin;
  int status = 0;
  pid_t ended = 0;
  while ((ended = waitpid(process_, &status, WNOHANG)) == 0 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (ended == 0) ending_.push_back(process_);
  process_ = -1;
  // A killed watchdog has not written zero, so this process writes it. Exception: if a frame is incomplete, the bytes
  // of the zero would become part of that frame and corrupt the stream.
  const bool was_killed = ended > 0 && WIFSIGNALED(status);
  const bool is_between_frames = !beat_->is_in_frame.load(std::memory_order_acquire);
  if (was_killed && is_between_frames && beat_->is_force_on.load(std::memory_order_relaxed)) send_zero(zero_);
}

void Watchdog::forget_ended() {
  std::erase_if(ending_, [](pid_t process) { return waitpid(process, nullptr, WNOHANG) != 0; });
}

void Watchdog::beat(LocalTime now, bool is_force_on) noexcept {
  beat_->at_ns.store(now.time_since_epoch().count(), std::memory_order_relaxed);
  beat_->is_force_on.store(is_force_on, std::memory_order_release);
}

bool Watchdog::has_released_force() noexcept {
  const std::uint32_t releases = beat_->releases.load(std::memory_order_acquire);
  return seen_.exchange(releases, std::memory_order_acq_rel) != releases;
}

bool Watchdog::send_packet(const WatchdogFrameHead& head, std::span<const std::uint8_t> frame) noexcept {
  std::array<std::uint8_t, sizeof(WatchdogFrameHead) + kMaxFrameBytes> packet;
  if (frame.empty() || frame.size() > kMaxFrameBytes) return false;
  std::memcpy(packet.data(), &head, sizeof head);
  std::ranges::copy(frame, packet.begin() + sizeof head);
  const std::size_t size = sizeof head + frame.size();
  return ::send(lifeline_, packet.data(), size, MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(size);
}

bool Watchdog::send(std::span<const std::uint8_t> frame, bool is_force_on) noexcept {
  sent_ = std::max(sent_ + 1, 1U);
  return send_packet({.number = sent_, .known_releases = known_releases_, .is_force_on = is_force_on ? 1U : 0U}, frame);
}

bool Watchdog::send_reply(std::span<const std::uint8_t> frame) noexcept {
  return send_packet({}, frame);
}

bool Watchdog::has_ended() const noexcept {
  pollfd end{lifeline_, 0, 0};
  return lifeline_ >= 0 && poll(&end, 1, 0) == 1 && (end.revents & (POLLHUP | POLLERR)) != 0;
}

bool Watchdog::is_written() const noexcept {
  return beat_->written.load(std::memory_order_acquire) == sent_;
}

}  // namespace tandem::devices
