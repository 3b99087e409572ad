// Where a trajectory is by now that is known only until a while ago.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Of a low pass of first order: the part of the way to its input that it goes in a period.
inline double low_pass_part(double corner_hz, double period_s) noexcept {
  return 1 - std::exp(-2 * std::numbers::pi * corner_hz * period_s);
}

/// Continues a trajectory over its age, from how it moved and how something moves that it may go along with.
///
/// Model   x̂(t) − x(t−H) = g Σ c_i φ_i(t), φ: H times the velocity through a low pass of kFast_hz, the same of kSlow_hz,
///         and the way of what it may go along with. Direct autoregression over the whole horizon: what x has done since
///         t−H is regressed on what each φ was then, by least squares that forget in kMemory_s, so that long ways count
///         more than tremor, with a prior that is not forgotten: what is best for movements of least jerk of 0.4 to 2 s.
///         g: the share of such forecasts that came true lately, at most kMaxShare; so it is never much worse than to hold
///         x(t−H). Where the forecast acts back on x, with `caution`, a prior of half of that is better.
/// Limits  a movement that begins or ends within H is not foreseen: with the acceleration a it errs by up to a H²/2
/// Source  direct multi-step forecasts: Marcellino, Stock, Watson, "A comparison of direct and iterated multistep AR
///         methods", J. Econometrics 135, 2006; ridge regression; the features and figures are ours
/// Thread  one; no allocation, no throw; finite for finite input
class TrajectoryForecast {
 public:
  static constexpr double kMaxHorizon_s = 0.5;
  static constexpr double kFast_hz = 4;
  static constexpr double kSlow_hz = 0.7;
  static constexpr double kMemory_s = 3;
  static constexpr double kScoreMemory_s = 1;
  /// Who is foreseen to go too far drags others along and makes energy; who is foreseen to lag takes some, but tilts what
  /// two press between them: with 0.8 two of 66 fast carries made 4 mJ by that, with 1 most do, and a
  /// ligand that snaps in is shown steps twice as large.
  static constexpr double kMaxShare = 0.83;

  struct Way {
    Vec3 way = Vec3::Zero();
    Vec3 velocity = Vec3::Zero();
  };

  /// In      typical_way  of one horizon; what the prior and the score are weighed by, in units of x
  ///         prior_along  how far x goes along with what it may, where nothing is known of that yet
  TrajectoryForecast(double typical_way, double prior_along) : typical_way_(typical_way), prior_along_(prior_along) {}

  /// Once a period.
  /// In      known  x(t − horizon_s)
  ///         along  of what it may go along with: since then, and now
  ///         caution  0: x goes where it will, whatever is foreseen of it … 1: the forecast acts back on it
  /// Out     x̂(t) − x(t − horizon_s), and the velocity of x̂
  Way step(const Vec3& known, double horizon_s, const Way& along, double caution, double period_s) noexcept;
  void reset() noexcept { *this = TrajectoryForecast(typical_way_, prior_along_); }
  /// g, of the last forecast.
  double share() const { return share_; }
  const Vec3& coefficients() const { return c_; }

 private:
  static constexpr std::size_t kKept = 512;

  void learn(const Vec3& known, double horizon_s, double period_s) noexcept;

  double typical_way_, prior_along_;
  std::array<Vec3, kKept> known_;                ///< rings, one step each
  std::array<Eigen::Matrix3d, kKept> features_;  ///< a column each
  std::array<Vec3, kKept> ways_;                 ///< forecast with g = 1
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  Vec3 fast_ = Vec3::Zero();  ///< x through the low passes
  Vec3 slow_ = Vec3::Zero();
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();  ///< Σ φ φᵀ
  Vec3 products_ = Vec3::Zero();                       ///< Σ φ y
  double came_true_ = 0;                               ///< Σ y · ŷ …
  double forecast_ = 0;                                ///< … over Σ ŷ²
  Vec3 c_ = Vec3::Zero();
  double share_ = 1;
};

}  // namespace tandem::haptics
