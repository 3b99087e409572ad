// Fits least-squares polynomials to a few points and chooses a degree that the points support.
#pragma once

#include <functional>
#include <span>

#include "common/haptics/coupling/adaptive.hpp"

namespace tandem::lab {

/// Returns the least-squares polynomial of the given degree (0 to 3) for at least degree + 1 points.
haptics::Cubic least_squares(std::span<const double> x, std::span<const double> y, int degree);

struct ChosenFit {
  haptics::Cubic cubic;
  int degree = 0;
  double left_out_rms = 0;  ///< RMS of the leave-one-out errors; 0 for one or two points
};

/// Chooses the degree (0 to 3) with the smallest leave-one-out error. The rules are:
/// * The first and the last point are never left out.
/// * A higher degree is chosen only if it lowers the error by a tenth.
/// * A degree is excluded if it has as many coefficients as there are points, because its fit would pass through all of
///   them. It is also excluded if `is_allowed` returns false for its fit. Degree 0 is always allowed.
/// * Exception: two points with different y values give a line through both if `is_allowed` accepts it.
///
/// In      x  in ascending order; equal values are allowed
ChosenFit chosen_fit(std::span<const double> x, std::span<const double> y,
                     const std::function<bool(const haptics::Cubic&)>& is_allowed);

}  // namespace tandem::lab
