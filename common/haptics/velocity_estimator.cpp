#include "common/haptics/velocity_estimator.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::haptics {
namespace {

/// Positions or rotations of the samples in the window, relative to the newest sample. The newest is first.
struct History {
  std::array<Vec3, VelocityEstimator::kMaxSamples> x;
  std::array<double, VelocityEstimator::kMaxSamples> age_s;  ///< age of each sample in x, ≥ 0
  std::size_t count = 0;
};

struct Line {
  Vec3 slope = Vec3::Zero();
  std::size_t window = 0;  ///< number of periods; 0: no line
};

/// Returns true if no component of any position deviates from the line by more than `tolerance`.
bool lies_on(const History& history, std::size_t window, const Vec3& mean, double mean_age_s, const Vec3& slope,
             double tolerance) {
  for (std::size_t i = 0; i <= window; ++i) {
    const Vec3 miss = history.x[i] - mean - slope * (mean_age_s - history.age_s[i]);
    if (!(miss.cwiseAbs().maxCoeff() <= tolerance)) return false;
  }
  return true;
}

// Returns the longest line that fits the newest samples. Windows of growing length are fitted by least squares until a
// sample deviates from its line by more than one step. One step allows for two errors of half a step each: the
// quantization error of the sample, and the error of the fitted line. At the ends of short windows, the line's error is
// larger.
Line longest_line(const History& history, double step, std::size_t most) {
  Line line;
  if (history.count < 2) return line;
  line = {(history.x[0] - history.x[1]) / (history.age_s[1] - history.age_s[0]), 1};
  if (step <= 0) return line;
  Vec3 sum = history.x[0] + history.x[1];
  double age_sum = history.age_s[0] + history.age_s[1];
  for (std::size_t window = 2; window <= std::min(most, history.count - 1); ++window) {
    sum += history.x[window];
    age_sum += history.age_s[window];
    const auto samples = static_cast<double>(window + 1);
    const Vec3 mean = sum / samples;
    const double mean_age = age_sum / samples;
    Vec3 moment = Vec3::Zero();
    double square = 0;
    for (std::size_t i = 0; i <= window; ++i) {
      const double since = mean_age - history.age_s[i];
      moment += since * (history.x[i] - mean);
      square += since * since;
    }
    const Vec3 slope = moment / square;
    if (!lies_on(history, window, mean, mean_age, slope, step)) break;
    line = {slope, window};
  }
  return line;
}

}  // namespace

VelocityEstimator::VelocityEstimator(double position_step_m, double rotation_step_rad, std::size_t window)
    : position_step_m_(position_step_m),
      rotation_step_rad_(rotation_step_rad),
      window_(std::clamp<std::size_t>(window, 1, kMaxSamples - 1)) {}

Twist VelocityEstimator::add(LocalTime taken, const Pose& X) noexcept {
  if (!is_finite(X) || (count_ > 0 && taken <= samples_[newest_].taken)) return twist_;
  newest_ = (newest_ + 1) % kMaxSamples;
  samples_[newest_] = {taken, X};
  count_ = std::min(count_ + 1, window_ + 1);
  History linear, angular;
  linear.count = angular.count = count_;
  for (std::size_t i = 0; i < count_; ++i) {
    const Sample& sample = samples_[(newest_ + kMaxSamples - i) % kMaxSamples];
    linear.x[i] = sample.X.p - X.p;
    angular.x[i] = rotation_vector(sample.X.q * X.q.conjugate());
    linear.age_s[i] = angular.age_s[i] = to_seconds(taken - sample.taken);
  }
  const Line travel = longest_line(linear, position_step_m_, window_);
  const Line turn = longest_line(angular, rotation_step_rad_, window_);
  const Twist found{travel.slope, turn.slope};
  // For extremely large positions, the fit can overflow. The previous velocity is then kept.
  if (is_finite(found)) twist_ = found;
  linear_delay_ = from_seconds(linear.age_s[travel.window] / 2);
  angular_delay_ = from_seconds(angular.age_s[turn.window] / 2);
  return twist_;
}

void VelocityEstimator::reset() noexcept {
  count_ = 0;
  twist_ = {};
  linear_delay_ = angular_delay_ = Duration(0);
}

Duration VelocityEstimator::linear_delay() const noexcept {
  return linear_delay_;
}
Duration VelocityEstimator::angular_delay() const noexcept {
  return angular_delay_;
}

}  // namespace tandem::haptics
