#include "devices/mouse/rumble.hpp"

#include <fcntl.h>
#include <linux/input.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace tandem::devices {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds(20);
constexpr int kPeriodsAPlay = 5, kPeriodsAnOpen = 50;
// Number of periods (0.1 s in all) without a call of show() after which the haptic loop counts as hanging.
constexpr int kMaxSilentPeriods = 5;
constexpr std::uint16_t kLength_ms = 200;
constexpr double kSmallest = 1.0 / 64;  // minimum change of strength that is sent

/// Opens a game pad and returns its file descriptor. Returns a negative number if the pad cannot be opened or has no
/// rumble motors; errno then gives the reason.
int opened(const std::string& node) {
  const int pad = open(node.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
  if (pad < 0) return pad;
  std::array<unsigned char, FF_MAX / 8 + 1> bits{};
  const bool is_known = ioctl(pad, EVIOCGBIT(EV_FF, bits.size()), bits.data()) >= 0;
  if (is_known && (bits[FF_RUMBLE / 8] >> (FF_RUMBLE % 8) & 1) != 0) return pad;
  close(pad);
  errno = ENOTSUP;
  return -1;
}

}  // namespace

Rumble::Rumble(std::string node) : node_(std::move(node)), pad_(opened(node_)) {
  if (pad_ < 0) {
    throw std::runtime_error("--rumble: " + node_ + " is no game pad that rumbles, or may not be opened (" +
                             std::generic_category().message(errno) + "); name another node, or use --rumble off");
  }
  thread_ = std::thread([this] { run(); });
}

Rumble::~Rumble() {
  should_stop_.store(true, std::memory_order_relaxed);
  thread_.join();
  if (pad_ < 0) return;
  send(0);
  close(pad_);
}

void Rumble::show(double share) noexcept {
  share_.store(std::isfinite(share) ? static_cast<float>(std::clamp(share, 0.0, 1.0)) : 0.0F,
               std::memory_order_relaxed);
  shows_.fetch_add(1, std::memory_order_relaxed);
}

void Rumble::run() {
  double sent = 0;
  std::uint32_t shows = 0;
  int silent_periods = 0;
  for (int periods = 1; !should_stop_.load(std::memory_order_relaxed); ++periods) {
    silent_periods = std::exchange(shows, shows_.load(std::memory_order_relaxed)) == shows ? silent_periods + 1 : 0;
    const double share = silent_periods < kMaxSilentPeriods ? share_.load(std::memory_order_relaxed) : 0.0;
    const bool is_due = std::abs(share - sent) >= kSmallest || (sent > 0 && periods % kPeriodsAPlay == 0);
    if (pad_ >= 0 && is_due) {
      sent = share < kSmallest ? 0 : share;
      if (!send(sent)) {
        close(std::exchange(pad_, -1));
        effect_ = -1;
      }
    }
    if (pad_ < 0 && periods % kPeriodsAnOpen == 0) pad_ = opened(node_);
    std::this_thread::sleep_for(kPeriod);
  }
}

/// Sends a strength to the game pad. Returns false if the pad is disconnected.
bool Rumble::send(double share) {
  ff_effect effect{};
  effect.type = FF_RUMBLE;
  effect.id = static_cast<std::int16_t>(effect_);
  effect.replay.length = kLength_ms;
  effect.u.rumble.strong_magnitude = static_cast<std::uint16_t>(share * 0xffff);
  effect.u.rumble.weak_magnitude = static_cast<std::uint16_t>(share * 0x7fff);
  if (ioctl(pad_, EVIOCSFF, &effect) < 0) return false;
  effect_ = effect.id;
  input_event play{};
  play.type = EV_FF;
  play.code = static_cast<std::uint16_t>(effect_);
  play.value = share > 0 ? 1 : 0;
  return write(pad_, &play, sizeof play) == sizeof play;
}

std::unique_ptr<Rumble> open_rumble(const std::string& wish) {
  if (wish == "off") return nullptr;
  if (wish != "auto") return std::make_unique<Rumble>(wish);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/input", error)) {
    if (!entry.path().filename().string().starts_with("event")) continue;
    const int pad = opened(entry.path());
    if (pad < 0) continue;
    close(pad);
    return std::make_unique<Rumble>(entry.path());
  }
  return nullptr;
}

}  // namespace tandem::devices
