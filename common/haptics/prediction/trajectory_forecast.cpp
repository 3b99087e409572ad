#include "common/haptics/prediction/trajectory_forecast.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace tandem::haptics {
namespace {

struct Prior {
  double fast;
  double slow;
};
/// Prior of c_fast and c_slow for horizons of 0, 0.1 … 0.5 s: the least-squares fit to minimum-jerk movements of 0.4 to
/// 2 s with pauses of up to 0.5 s.
constexpr std::array<Prior, 6> kPriors{
    {{1.30, -0.36}, {1.34, -0.50}, {1.27, -0.54}, {1.13, -0.51}, {1.00, -0.45}, {0.87, -0.39}}};
constexpr Prior kCautiousPrior{0.9, -0.4};

Prior between(const Prior& a, const Prior& b, double u) {
  return {a.fast + u * (b.fast - a.fast), a.slow + u * (b.slow - a.slow)};
}

Prior prior_of(double horizon_s, double caution) {
  const double place = horizon_s / TrajectoryForecast::kMaxHorizon_s * (kPriors.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(place), kPriors.size() - 2);
  return between(between(kPriors[i], kPriors[i + 1], place - static_cast<double>(i)), kCautiousPrior, caution);
}

/// Weights of the prior and of the initial score, as durations [s]. Each weight equals that of data observed for this
/// duration while x moves by typical displacements.
constexpr double kPriorWorth_s = 2;
constexpr double kScoreWorth_s = 0.05;

}  // namespace

void TrajectoryForecast::learn(const Vec3& known, double horizon_s, double period_s) noexcept {
  const auto steps = static_cast<std::size_t>(std::lround(horizon_s / period_s));
  if (steps == 0 || steps > count_ || steps >= kKept) return;
  const std::size_t then = (next_ + kKept - steps) % kKept;
  const Vec3 way = known - known_[then];
  const double kept = std::exp(-period_s / kMemory_s);
  squares_ *= kept;
  products_ *= kept;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 phi = features_[then].row(axis);
    squares_ += phi * phi.transpose();
    products_ += phi * way[axis];
  }
  const double score_kept = std::exp(-period_s / kScoreMemory_s);
  came_true_ = score_kept * came_true_ + way.dot(ways_[then]);
  forecast_ = score_kept * forecast_ + ways_[then].squaredNorm();
}

TrajectoryForecast::Way TrajectoryForecast::step(const Vec3& known, double horizon_s, const Way& along, double caution,
                                                 double period_s) noexcept {
  const double horizon = std::clamp(horizon_s, 0.0, kMaxHorizon_s);
  if (count_ == 0) fast_ = slow_ = known;
  const double fast_part = low_pass_part(kFast_hz, period_s), slow_part = low_pass_part(kSlow_hz, period_s);
  fast_ += fast_part * (known - fast_);
  slow_ += slow_part * (known - slow_);
  const Vec3 v_fast = (known - fast_) * (fast_part / period_s), v_slow = (known - slow_) * (slow_part / period_s);
  learn(known, horizon, period_s);

  const double unit = typical_way_ * typical_way_ / period_s;
  const double worth = kPriorWorth_s * unit;
  const Prior prior = prior_of(horizon, caution);
  const Eigen::Matrix3d A = squares_ + worth * Eigen::Matrix3d::Identity();
  c_ = A.llt().solve(products_ + worth * Vec3(prior.fast, prior.slow, prior_along_));
  const double score_worth = kScoreWorth_s * unit;
  share_ = std::clamp((came_true_ + score_worth) / (forecast_ + score_worth), 0.0, 1.0) * kMaxShare;

  known_[next_] = known;
  features_[next_] << horizon * v_fast, horizon * v_slow, along.way;
  ways_[next_] = features_[next_] * c_;
  const Vec3 way = share_ * ways_[next_];
  next_ = (next_ + 1) % kKept;
  count_ = std::min(count_ + 1, kKept);
  return {way, share_ * (c_[0] * v_fast + c_[1] * v_slow + c_[2] * along.velocity)};
}

}  // namespace tandem::haptics
