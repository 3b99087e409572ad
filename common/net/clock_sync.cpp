#include "common/net/clock_sync.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::net {

bool ClockSync::add(LocalTime t1, ServerTime t2, ServerTime t3, LocalTime t4) {
  const Duration outside = t4 - t1;
  const Duration held = t3 - t2;
  if (held < Duration{0} || outside < held) return false;

  const Duration there = t2.time_since_epoch() - t1.time_since_epoch();
  const Duration back = t3.time_since_epoch() - t4.time_since_epoch();
  round_trip_ = outside - held;
  if (!has_offset_) first_at_ = slewed_at_ = t4;
  slew(t4);  // completes the slew towards the previous target before the new sample changes the target
  const Duration::rep slot = t4.time_since_epoch() / kSlot;
  remember({.offset = (there + back) / 2, .delay = round_trip_, .at = t4, .slot = slot, .is_used = true});
  target_ = best_offset(t4);
  if (!has_offset_ || t4 - first_at_ < kSettling) current_ = target_;
  has_offset_ = true;
  return true;
}

void ClockSync::remember(const Sample& sample) {
  // The conversion to unsigned gives a valid index even for times before the clock's epoch.
  Sample& kept = samples_[static_cast<std::size_t>(sample.slot) % kSlots];
  if (!kept.is_used || kept.slot != sample.slot || sample.delay <= kept.delay) kept = sample;
}

Duration ClockSync::best_offset(LocalTime now) const {
  const Sample* best = nullptr;
  double least_error_ns = std::numeric_limits<double>::infinity();
  for (const Sample& sample : samples_) {
    if (!sample.is_used) continue;
    const double error_ns = 0.5 * static_cast<double>(sample.delay.count()) +
                            kDrift * std::abs(static_cast<double>((now - sample.at).count()));
    if (error_ns >= least_error_ns) continue;
    least_error_ns = error_ns;
    best = &sample;
  }
  return best != nullptr ? best->offset : target_;
}

void ClockSync::slew(LocalTime now) {
  const double elapsed_s = to_seconds(now - slewed_at_);
  if (elapsed_s <= 0) return;
  const Duration error = target_ - current_;
  const double error_s = std::abs(to_seconds(error));
  const double rate = std::clamp(error_s / kSlewTimeConstantS, kSlowestSlew, kFastestSlew);
  const Duration step = std::min(from_seconds(rate * elapsed_s), std::chrono::abs(error));
  // A step below one nanosecond is rounded to zero. In this case slewed_at_ stays unchanged, so that the elapsed time
  // of several calls adds up to a step of at least one nanosecond.
  if (step == Duration{0} && error != Duration{0}) return;
  slewed_at_ = now;
  current_ += error < Duration{0} ? -step : step;
}

Duration ClockSync::offset(LocalTime now) {
  slew(now);
  return current_;
}

std::optional<ServerTime> ClockSync::server_time(LocalTime now) {
  if (!has_offset_) return std::nullopt;
  return ServerTime(now.time_since_epoch() + offset(now));
}

Duration ClockSync::minimum_round_trip() const {
  std::optional<Duration> least;
  for (const Sample& sample : samples_) {
    if (sample.is_used) least = std::min(least.value_or(sample.delay), sample.delay);
  }
  return least.value_or(Duration{0});
}

}  // namespace tandem::net
