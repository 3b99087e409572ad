#include "lab/metrics/felt_mass.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "lab/metrics/metrics.hpp"

namespace tandem::lab {
namespace {

constexpr Duration kSkippedBegin{from_seconds(1.0)};
constexpr Duration kSkippedEnd{from_seconds(0.5)};
/// One row of the regression is taken every kStride ticks. This gives 100 rows per second, sufficient for motions of up
/// to 5 Hz.
constexpr std::size_t kStride = 10;
constexpr std::size_t kLag = 20;  ///< maximum lag of the covariance estimate, in rows: 0.2 s
constexpr std::size_t kMinRows = 200;
constexpr double kMinAcceleration_m_per_s2 = 0.01;  ///< minimum RMS acceleration for an estimate
constexpr double kNormal95 = 1.96;

using Row = Eigen::Vector3d;  ///< acceleration, velocity and position of one axis

/// Rows of one axis over time. Their mean is subtracted, so that the fit needs no offset.
struct AxisSeries {
  std::vector<Row> rows;
  std::vector<double> force;
};

/// First and last tick that the fit uses. The range is empty if the shake phase does not occur.
struct FittedRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};
FittedRange shaken_range(const UserTrace& user) {
  const auto& phases = user.user.hand.phases();
  const auto phase = static_cast<int>(std::find(phases.begin(), phases.end(), kShakePhase) - phases.begin());
  const auto is_in = [phase](const TickSample& tick) { return tick.phase == phase; };
  const auto first = std::find_if(user.ticks.begin(), user.ticks.end(), is_in);
  const auto last = std::find_if_not(first, user.ticks.end(), is_in);
  if (first == last) return {};
  const Duration from = first->time + kSkippedBegin;
  const Duration to = std::prev(last)->time - kSkippedEnd;
  FittedRange range{user.ticks.size(), 0};
  for (auto tick = first; tick != last; ++tick) {
    if (tick->time < from || tick->time > to) continue;
    const auto index = static_cast<std::size_t>(tick - user.ticks.begin());
    range.begin = std::min(range.begin, index);
    range.end = index + 1;
  }
  return range;
}

AxisSeries axis_series(const UserTrace& user, const FittedRange& range, int axis) {
  AxisSeries series;
  for (std::size_t k = std::max<std::size_t>(range.begin, 1); k + 1 < range.end; k += kStride) {
    const TickSample& before = user.ticks[k - 1];
    const TickSample& now = user.ticks[k];
    const TickSample& after = user.ticks[k + 1];
    const double a = (after.hand_twist_D.v - before.hand_twist_D.v)[axis] / to_seconds(after.time - before.time);
    series.rows.emplace_back(a, now.hand_twist_D.v[axis], now.hand_D.p[axis]);
    series.force.push_back(-0.5 * (before.displayed_D.f + now.displayed_D.f)[axis]);
  }
  Row mean = Row::Zero();
  double mean_force = 0;
  for (std::size_t i = 0; i < series.rows.size(); ++i) {
    mean += series.rows[i];
    mean_force += series.force[i];
  }
  const auto count = static_cast<double>(std::max<std::size_t>(series.rows.size(), 1));
  for (std::size_t i = 0; i < series.rows.size(); ++i) {
    series.rows[i] -= mean / count;
    series.force[i] -= mean_force / count;
  }
  return series;
}

/// Returns the covariance sum Σ x_t u_t u_s x_sᵀ over all pairs (t, s) of rows at most kLag apart, with Bartlett
/// weights. x_t is row t, and u_t is the residual of the fit at that row.
Eigen::Matrix3d newey_west(const AxisSeries& axis, const Row& fit) {
  std::vector<Row> scores;
  for (std::size_t i = 0; i < axis.rows.size(); ++i) {
    scores.emplace_back(axis.rows[i] * (axis.force[i] - axis.rows[i].dot(fit)));
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t lag = 0; lag <= kLag; ++lag) {
    const double weight = 1.0 - static_cast<double>(lag) / (kLag + 1.0);
    Eigen::Matrix3d at_lag = Eigen::Matrix3d::Zero();
    for (std::size_t i = lag; i < scores.size(); ++i) at_lag += scores[i] * scores[i - lag].transpose();
    sum += lag == 0 ? at_lag : Eigen::Matrix3d(weight * (at_lag + at_lag.transpose()));
  }
  return sum;
}

}  // namespace

FeltMass felt_mass(const UserTrace& user) {
  const FittedRange range = shaken_range(user);
  Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
  Row right = Row::Zero();
  std::vector<AxisSeries> axes;
  for (int axis = 0; axis < 3; ++axis) {
    const AxisSeries& series = axes.emplace_back(axis_series(user, range, axis));
    for (std::size_t i = 0; i < series.rows.size(); ++i) {
      gram += series.rows[i] * series.rows[i].transpose();
      right += series.rows[i] * series.force[i];
    }
  }
  const std::size_t rows = axes.front().rows.size();
  const double acceleration_rms = std::sqrt(gram(0, 0) / static_cast<double>(std::max<std::size_t>(rows, 1)));
  if (rows < kMinRows || acceleration_rms < kMinAcceleration_m_per_s2) return {kUndefined, kUndefined};
  // Acceleration, velocity and position differ by orders of magnitude, so the columns are scaled to unit length before
  // the inversion.
  const Row scale = gram.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix3d scaled = scale.asDiagonal() * gram * scale.asDiagonal();
  const Eigen::Matrix3d inverse = scale.asDiagonal() * scaled.inverse() * scale.asDiagonal();
  const Row fit = inverse * right;
  Eigen::Matrix3d meat = Eigen::Matrix3d::Zero();
  for (const AxisSeries& series : axes) meat += newey_west(series, fit);
  const double variance = (inverse * meat * inverse)(0, 0);
  return {fit[0], kNormal95 * std::sqrt(std::max(variance, 0.0))};
}

}  // namespace tandem::lab
