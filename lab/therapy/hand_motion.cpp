#include "lab/therapy/hand_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "lab/therapy/spectral_arc_length.hpp"

namespace tandem::lab {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kMaxGap_s = 0.25;
constexpr double kMaxDistance_m = 1000;
constexpr double kMoves_m_per_s = 0.02, kRests_m_per_s = 0.005;
constexpr auto kRestSamples = static_cast<std::size_t>(0.2 * kMotionRate_hz);
constexpr auto kMinMovementSamples = static_cast<std::size_t>(0.2 * kMotionRate_hz);
constexpr auto kMaxMovementSamples = static_cast<std::size_t>(60 * kMotionRate_hz);
constexpr auto kMarginSamples = static_cast<std::size_t>(0.1 * kMotionRate_hz);
constexpr auto kSecond = static_cast<std::size_t>(kMotionRate_hz);
static_assert(kMaxMovementSamples + 2 * kMarginSamples <= kMaxSpeedSamples);

/// Returns the speed at a sample [m/s]. The derivative uses five samples around it; near a gap it uses fewer, as far as
/// they were measured.
double speed_at(const std::vector<Vec3>& p, std::size_t i) {
  const auto has = [&](std::ptrdiff_t offset) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) + offset;
    return at >= 0 && at < static_cast<std::ptrdiff_t>(p.size()) && p[static_cast<std::size_t>(at)].allFinite();
  };
  if (!has(0)) return kNone;
  if (has(-2) && has(-1) && has(1) && has(2))
    return (p[i - 2] - 8 * p[i - 1] + 8 * p[i + 1] - p[i + 2]).norm() * kMotionRate_hz / 12;
  if (has(-1) && has(1)) return (p[i + 1] - p[i - 1]).norm() * kMotionRate_hz / 2;
  if (has(1)) return (p[i + 1] - p[i]).norm() * kMotionRate_hz;
  if (has(-1)) return (p[i] - p[i - 1]).norm() * kMotionRate_hz;
  return kNone;
}

/// Returns the movement between two samples, first and last included.
Movement movement_of(const HandMotion& motion, std::size_t first, std::size_t last) {
  const std::vector<double>& speed = motion.speed_m_per_s;
  Movement movement{.begin_s = static_cast<double>(first) / kMotionRate_hz,
                    .duration_s = static_cast<double>(last - first) / kMotionRate_hz,
                    .path_m = path_length_m(motion, first, last + 1),
                    .peak_speed_m_per_s = *std::max_element(speed.begin() + static_cast<std::ptrdiff_t>(first),
                                                            speed.begin() + static_cast<std::ptrdiff_t>(last) + 1),
                    .smoothness = kNone};
  if (last - first > kMaxMovementSamples) return movement;
  std::size_t begin = first, end = last;
  while (begin > 0 && first - begin < kMarginSamples && std::isfinite(speed[begin - 1])) --begin;
  while (end + 1 < speed.size() && end - last < kMarginSamples && std::isfinite(speed[end + 1])) ++end;
  movement.smoothness = spectral_arc_length(std::span(speed).subspan(begin, end - begin + 1), kMotionRate_hz);
  return movement;
}

}  // namespace

void MotionSampler::add(double at_s, const Vec3& p_W) {
  if (!(at_s >= 0 && at_s <= kMaxSession_s) || !p_W.allFinite() || p_W.norm() > kMaxDistance_m) {
    ++ignored_;
    return;
  }
  const auto index = static_cast<std::size_t>(at_s * kMotionRate_hz);
  if (index >= intervals_.size()) intervals_.resize(index + 1);
  Interval& interval = intervals_[index];
  interval.sum += p_W;
  interval.time_sum_s += at_s;
  ++interval.count;
}

HandMotion MotionSampler::motion() const {
  HandMotion motion;
  motion.p_W.assign(intervals_.size(), Vec3::Constant(kNone));
  bool has_previous = false;
  double previous_s = 0;
  Vec3 previous_W = Vec3::Zero();
  std::size_t next = 0;  // index of the first output sample after the previous average
  for (const Interval& interval : intervals_) {
    if (interval.count == 0) continue;
    const double at_s = interval.time_sum_s / interval.count;
    const Vec3 p_W = interval.sum / interval.count;
    if (!has_previous || at_s - previous_s > kMaxGap_s) {
      // After a gap, the output sample up to 10 ms before the first average gets the position of this average.
      next = static_cast<std::size_t>(&interval - intervals_.data());
      previous_s = at_s;
      previous_W = p_W;
      has_previous = true;
    }
    for (; next < motion.p_W.size(); ++next) {
      const double sample_s = static_cast<double>(next) / kMotionRate_hz;
      if (sample_s > at_s) break;
      const double share = at_s > previous_s ? std::clamp((sample_s - previous_s) / (at_s - previous_s), 0.0, 1.0) : 1;
      motion.p_W[next] = previous_W + share * (p_W - previous_W);
    }
    previous_s = at_s;
    previous_W = p_W;
  }
  for (std::size_t i = 0; i < motion.p_W.size(); ++i) motion.speed_m_per_s.push_back(speed_at(motion.p_W, i));
  return motion;
}

std::vector<Movement> movements_of(const HandMotion& motion) {
  std::vector<Movement> movements;
  const std::vector<double>& speed = motion.speed_m_per_s;
  std::optional<std::size_t> first;  // first sample of the current movement
  std::size_t last = 0;              // last sample of the current movement with a speed of at least kRests_m_per_s
  bool has_moved = false;
  const auto finish = [&] {
    if (first && has_moved && last - *first >= kMinMovementSamples)
      movements.push_back(movement_of(motion, *first, last));
    first.reset();
    has_moved = false;
  };
  for (std::size_t i = 0; i < speed.size(); ++i) {
    if (!std::isfinite(speed[i])) {
      finish();
    } else if (speed[i] >= kRests_m_per_s) {
      if (!first) first = i;
      last = i;
      has_moved = has_moved || speed[i] >= kMoves_m_per_s;
    } else if (first && i - last >= kRestSamples) {
      finish();
    }
  }
  finish();
  return movements;
}

double path_length_m(const HandMotion& motion, std::size_t first, std::size_t last) {
  double length = 0;
  for (std::size_t i = first + 1; i < std::min(last, motion.p_W.size()); ++i) {
    const double step = (motion.p_W[i] - motion.p_W[i - 1]).norm();
    if (std::isfinite(step)) length += step;
  }
  return length;
}

double quantile(std::vector<double> values, double q) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) return kNone;
  const double at = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::ptrdiff_t>(at);
  std::ranges::nth_element(values, values.begin() + below);
  const double low = values[static_cast<std::size_t>(below)];
  if (at == static_cast<double>(below)) return low;
  const double high = *std::min_element(values.begin() + below + 1, values.end());
  return low + (at - static_cast<double>(below)) * (high - low);
}

std::vector<double> MotionRange::reach_m() const {
  std::vector<double> reach;
  for (int axis = 0; axis < 3; ++axis) {
    reach.push_back(start_m[axis] - low_m[axis]);
    reach.push_back(high_m[axis] - start_m[axis]);
  }
  return reach;
}

std::optional<MotionRange> range_of(const HandMotion& motion, std::size_t first, std::size_t last) {
  std::array<std::vector<double>, 3> values, start;
  std::size_t rest = 0;
  for (std::size_t i = first; i < std::min(last, motion.p_W.size()); ++i) {
    if (!motion.p_W[i].allFinite()) continue;
    rest = motion.speed_m_per_s[i] < kRests_m_per_s ? rest + 1 : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = motion.p_W[i][static_cast<int>(axis)];
      if (rest <= kRestSamples) values[axis].push_back(value);
      if (start[axis].size() < kSecond) start[axis].push_back(value);
    }
  }
  if (start[0].size() < kSecond) return std::nullopt;
  MotionRange range;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    range.low_m[i] = quantile(values[axis], 0.01);
    range.high_m[i] = quantile(values[axis], 0.99);
    range.start_m[i] = quantile(start[axis], 0.5);
  }
  return range;
}

}  // namespace tandem::lab
