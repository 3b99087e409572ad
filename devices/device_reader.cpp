#include "devices/device_reader.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace tandem::devices {
namespace {

// Maximum age of a sample. It equals the limit for a late tick of the haptic loop (SafetySettings::late_tick).
constexpr Duration kMaxAge = std::chrono::milliseconds(20);
constexpr double kMaxNormError = 1e-3;
// Minimum time between two samples in the computation of speed. With a shorter time, an encoder step between two quick
// reads would appear as a jump.
constexpr double kMinGap_s = 0.001;
constexpr double kSpeedMargin = 3;
// Maximum plausible angular speed; our choice. It must exceed two values: a wrist rotates at up to about 20 rad/s, and
// an encoder step of 0.1 rad within a millisecond gives 100 rad/s.
constexpr double kMaxReadTurn_rad_per_s = 300;

// Returns whether value ≤ most; false for a NaN.
bool is_within(double value, double most) {
  return value <= most;
}

}  // namespace

DeviceSample DeviceReader::read(LocalTime now) noexcept {
  DeviceSample sample = device_.read(now);
  sample.buttons &= device_.spec().buttons;
  sample.is_valid = sample.is_valid && sample.state == DeviceState::kReady;
  const bool is_checked = sample.is_valid;
  if (is_checked) {
    const std::string_view fault = find_fault(now, sample);
    sample.is_valid = fault.empty();
    if (!fault.empty()) sample.reason = fault;
  }
  has_before_ = is_checked && is_finite(sample.X_DH);
  if (has_before_) before_ = sample;
  return sample;
}

std::string_view DeviceReader::find_fault(LocalTime now, const DeviceSample& sample) const noexcept {
  if (!is_finite(sample.X_DH) || !is_finite(sample.V_DH)) {
    return "its pose or velocity is not a number; plug it in again";
  }
  if (now - sample.taken > kMaxAge || sample.taken - now > kMaxAge) {
    return "the time stamp of its samples does not advance or is wrong; check its cable, or plug it in again";
  }
  if (!is_within(std::abs(sample.X_DH.q.norm() - 1), kMaxNormError)) {
    return "its orientation is no rotation; plug it in again";
  }
  if (!is_within(sample.X_DH.p.stableNorm(), device_.spec().reach_m)) {
    return "its position is outside of the device's workspace; home it again, or check workspace_m of its profile";
  }
  const bool is_absurd = !is_within(sample.V_DH.v.stableNorm(), kSpeedMargin * device_.spec().speed_limit_m_per_s) ||
                         !is_within(sample.V_DH.w.stableNorm(), kMaxReadTurn_rad_per_s);
  if (is_absurd || has_jumped(sample)) return "its pose jumps or runs faster than any hand; check its cable";
  return {};
}

bool DeviceReader::has_jumped(const DeviceSample& sample) const noexcept {
  if (!has_before_) return false;
  const double gap_s = std::max(kMinGap_s, to_seconds(sample.taken - before_.taken));
  const double way_m = (sample.X_DH.p - before_.X_DH.p).stableNorm();
  const double turn_rad = sample.X_DH.q.angularDistance(before_.X_DH.q);
  return !is_within(way_m, kSpeedMargin * device_.spec().speed_limit_m_per_s * gap_s) ||
         !is_within(turn_rad, kMaxReadTurn_rad_per_s * gap_s);
}

}  // namespace tandem::devices
