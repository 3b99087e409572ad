#include "server/session/unix_time.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>

namespace tandem::server {
namespace {

/// Largest deviation of the wall clock between two updates that counts as drift. Real drift and the slew of adjtime(3)
/// are far smaller.
constexpr std::int64_t kDrift_ms = 1000;
/// End of the year 9999. Later times are clamped to it, so that sums do not overflow.
constexpr std::uint64_t kLatest_ms = 253'402'300'799'000;

std::int64_t milliseconds(LocalTime now) {
  return now.time_since_epoch() / std::chrono::milliseconds(1);
}

}  // namespace

std::uint64_t UnixTime::update(std::uint64_t wall_ms, LocalTime now) {
  const auto wall = static_cast<std::int64_t>(std::min(wall_ms, kLatest_ms)) - milliseconds(now);
  if (!offset_ms_) {
    offset_ms_ = std::max(wall, static_cast<std::int64_t>(std::min(last_ms_, kLatest_ms)) - milliseconds(now));
  }
  if (std::abs(wall - *offset_ms_) <= kDrift_ms) {
    offset_ms_ = wall;
    step_ms_.reset();
  } else if (!step_ms_ || std::abs(wall - *step_ms_) > kDrift_ms) {
    step_ms_ = wall;
    stepped_ = now;
  } else if (now - stepped_ >= kClockHold) {
    offset_ms_ = wall;
    step_ms_.reset();
  }
  return at(now);
}

std::uint64_t UnixTime::at(LocalTime now) const {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, offset_ms_.value_or(0) + milliseconds(now)));
}

std::optional<Duration> UnixTime::follows_in(LocalTime now) const {
  if (!step_ms_) return std::nullopt;
  return std::max(Duration{0}, stepped_ + kClockHold - now);
}

std::string utc_text(std::uint64_t unix_ms) {
  const auto seconds = static_cast<std::time_t>(std::min(unix_ms, kLatest_ms) / 1000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", &utc);
  return text.data();
}

}  // namespace tandem::server
