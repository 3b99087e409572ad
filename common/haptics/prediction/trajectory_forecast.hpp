// Forecast of a trajectory whose samples arrive with a delay.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Returns the fraction of the distance to its input that a first-order low pass covers in one period.
inline double low_pass_part(double corner_hz, double period_s) noexcept {
  return 1 - std::exp(-2 * std::numbers::pi * corner_hz * period_s);
}

/// Extrapolates a trajectory over the age of its samples, from its past motion and from the motion of a body that it
/// may follow.
///
/// Model   The forecast of x at the time t from the newest sample x(t−H), over the horizon H, is
///           x̂(t) − x(t−H) = g Σ c_i φ_i(t)
///         with the gain g, the coefficients c_i and three features φ_i:
///         1. H times the velocity after a low pass of kFast_hz
///         2. H times the velocity after a low pass of kSlow_hz
///         3. the displacement of the body that x may follow
///         c_i: least-squares regression of the displacement of x since t−H on the features at t−H (direct
///         autoregression over the whole horizon). Old squares are forgotten with the time constant kMemory_s. Large
///         displacements have large squares, so they influence c_i more than tremor. A prior of constant weight
///         contains the best coefficients for minimum-jerk movements of 0.4 to 2 s. If the forecast acts back on x,
///         `caution` blends this prior with another one that is about half as large.
///         g: kMaxShare times the slope of the observed displacements over the forecast ones in the last
///         kScoreMemory_s, with the slope clamped to 0 … 1. The error is therefore never much larger than that of
///         holding x(t−H)
/// Limits  A movement that begins or ends within H is not predicted. The error is then up to a H²/2 at an acceleration
///         a
/// Source  direct multi-step forecasts: Marcellino, Stock, Watson, "A comparison of direct and iterated multistep AR
///         methods", J. Econometrics 135, 2006; ridge regression. The features and the numbers are ours
/// Thread  always the same thread; no allocation, no throw; finite for finite input
class TrajectoryForecast {
 public:
  static constexpr double kMaxHorizon_s = 0.5;
  static constexpr double kFast_hz = 4;
  static constexpr double kSlow_hz = 0.7;
  static constexpr double kMemory_s = 3;
  static constexpr double kScoreMemory_s = 1;
  /// Upper bound of g, chosen by measurements of two users who carry an object, and of a ligand that snaps in:
  /// * If the prediction of a hand is too far ahead, it drags other hands along and creates energy. With the bound 1,
  ///   most fast carries did this, and the force steps of the ligand doubled. With 0.8, 2 of 66 fast carries created 4
  ///   mJ.
  /// * If the prediction lags, it dissipates energy, but tilts an object that two users squeeze.
  static constexpr double kMaxShare = 0.83;

  struct Way {
    Vec3 way = Vec3::Zero();
    Vec3 velocity = Vec3::Zero();
  };

  /// In      typical_way  typical displacement of x over one horizon, in units of x; scales the weights of the prior
  ///         and of the initial score
  ///         prior_along  prior of the coefficient c_3, for the displacement of the body that x may follow
  TrajectoryForecast(double typical_way, double prior_along) : typical_way_(typical_way), prior_along_(prior_along) {}

  /// Adds a sample and returns the forecast. Called once a period.
  /// In      known  newest known value x(t − horizon_s)
  ///         along  motion of the body that x may follow: its displacement since t − horizon_s, and its present
  ///         velocity
  ///         caution  influence of the forecast on x, from 0 (none) to 1 (the forecast acts back on x)
  /// Out     x̂(t) − x(t − horizon_s), and the velocity of x̂
  Way step(const Vec3& known, double horizon_s, const Way& along, double caution, double period_s) noexcept;
  void reset() noexcept { *this = TrajectoryForecast(typical_way_, prior_along_); }
  /// Factor g of the last forecast.
  double share() const { return share_; }
  const Vec3& coefficients() const { return c_; }

 private:
  static constexpr std::size_t kKept = 512;

  void learn(const Vec3& known, double horizon_s, double period_s) noexcept;

  double typical_way_, prior_along_;
  std::array<Vec3, kKept> known_;                ///< known x; the three arrays are rings with one entry for each step
  std::array<Eigen::Matrix3d, kKept> features_;  ///< features φ, in one column each
  std::array<Vec3, kKept> ways_;                 ///< displacements that were forecast, before the factor g
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  Vec3 fast_ = Vec3::Zero();  ///< x after the two low passes
  Vec3 slow_ = Vec3::Zero();
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();  ///< Σ φ φᵀ of the regression
  Vec3 products_ = Vec3::Zero();                       ///< Σ φ y of the regression
  double came_true_ = 0;                               ///< numerator of g: Σ y · ŷ
  double forecast_ = 0;                                ///< denominator of g: Σ ŷ²
  Vec3 c_ = Vec3::Zero();
  double share_ = 1;
};

}  // namespace tandem::haptics
