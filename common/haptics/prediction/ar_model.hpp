// Autoregressive (AR) models, which predict the next value of a force series. A model is fitted by one of three
// methods; its order p can be chosen by comparing the errors of several orders.
//
// Letters   x_t  series   φ_i  coefficients   p  order   N  number of samples   V  variance of the one-step error
//           x̂_{t+1} = m + Σ_{i=1..p} φ_i (x_{t+1−i} − m)      m  mean of the window (0 if differences are modelled)
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace tandem::haptics {

inline constexpr std::size_t kMaxArOrder = 32;

enum class ArFit : std::uint8_t {
  kYuleWalker,    ///< biased autocovariance, Levinson: always stable; adds damping to weakly damped oscillations
  kLeastSquares,  ///< covariance method: smallest one-step error; an unstable fit is replaced by a stable one
  kBurg,          ///< smallest sum of forward and backward errors: always stable, and accurate on short windows
};
/// Returns an empty string for an invalid value.
std::string_view name_of(ArFit fit);

/// Coefficients fitted to one series. A model of order 0 predicts the mean.
struct ArModel {
  std::size_t order = 0;
  std::array<double, kMaxArOrder> phi{};  ///< φ_1 … φ_p; entries beyond `order` are zero
  double mean = 0;
  double error_variance = 0;  ///< V, variance of the one-step error within the window

  /// Returns x̂ one step after `newest_first` (x_t, x_{t−1}, …; at least `order` values).
  double next(std::span<const double> newest_first) const noexcept;
};

/// Fits φ to `series` (oldest sample first). If the series has no variance, is too short (N ≤ 2p) or is not finite,
/// returns order 0 with the mean of its finite samples. The coefficients are always finite, and the model is always
/// stable.
///
/// Model   * Yule–Walker: Σ_j φ_j r_|i−j| = r_i with the autocovariance r_k = (1/N) Σ x_t x_{t+k}; solved by Levinson's
///         recursion
///         * least squares: min Σ_{t>p} (x_t − Σ φ_i x_{t−i})²; normal equations with a ridge of 1e-9 of their trace
///         * Burg: reflection coefficients k_m = 2 Σ f b / Σ (f² + b²), with the forward errors f and the backward
///           errors b
/// Source   Kay, "Modern Spectral Estimation", 1988, ch. 7; Burg, PhD thesis, Stanford, 1975
/// Limits  A least-squares fit can be unstable. Each φ_i is then multiplied by γ^i, which multiplies every root of the
///         model by γ. γ is the largest value for which all roots lie within kMaxArRadius. The scaled fit no longer has
///         the least error
/// In       order  0 … kMaxArOrder    takes_mean  whether the mean of the series is subtracted first
/// Cost     O(N p) (Burg, Yule–Walker), O(N p²/2) (least squares); Burg allocates
/// Thread  any but haptic
ArModel fit_ar(std::span<const double> series, std::size_t order, ArFit fit, bool takes_mean);

/// Largest magnitude of a root after make_stable(). Our choice: slightly inside the unit circle, at which a
/// model becomes unstable.
inline constexpr double kMaxArRadius = 0.999;

/// Solves the Toeplitz system Σ_j φ_j r_|i−j| = r_i for φ_1 … φ_p; r has p + 1 elements. If the matrix is not positive
/// definite, returns false. `phi` then holds the solution of the largest leading system that is positive definite,
/// followed by zeros.
bool levinson(std::span<const double> r, std::span<double> phi, double& error_variance) noexcept;

/// Returns whether all roots of z^p − Σ φ_i z^(p−i) lie inside the circle with this radius.
///
/// Model    Schur–Cohn test: step-down recursion; all reflection coefficients must be below 1 in magnitude
bool is_stable(std::span<const double> phi, double radius = 1.0) noexcept;
/// Scales the roots down until is_stable(phi, radius). Leaves a stable model unchanged.
void make_stable(std::span<double> phi, double radius) noexcept;

/// One row of a comparison of orders.
struct ArOrder {
  std::size_t order = 0;
  double error_variance = 0;  ///< V
  double fpe = 0;             ///< Akaike's final prediction error, V (1 + d/N)/(1 − d/N) with d = order
};
/// Returns one row for each order 0 … most_order; fewer if the series is too short (N ≤ 2p).
///
/// Source  Akaike, "Fitting autoregressive models for prediction", Ann. Inst. Statist. Math. 21, 1969; d = p is the
///         number of estimated coefficients
std::vector<ArOrder> fpe_of_orders(std::span<const double> series, std::size_t most_order, ArFit fit, bool takes_mean);
/// Returns the order with the smallest FPE. Throws std::invalid_argument if `orders` is empty.
std::size_t best_order(std::span<const ArOrder> orders);

}  // namespace tandem::haptics
