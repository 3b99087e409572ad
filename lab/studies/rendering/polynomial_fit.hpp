// Least-squares polynomials of few points, with a degree that the points support.
#pragma once

#include <functional>
#include <span>

#include "common/haptics/coupling/adaptive.hpp"

namespace tandem::lab {

/// Least-squares polynomial of the given degree, 0 to 3, through at least degree + 1 points.
haptics::Cubic least_squares(std::span<const double> x, std::span<const double> y, int degree);

struct ChosenFit {
  haptics::Cubic cubic;
  int degree = 0;
  double left_out_rms = 0;  ///< leave-one-out error; 0 for one or two points
};

/// Chooses the degree, 0 to 3, with the smallest leave-one-out error; the first and the last point are never left out.
/// A higher degree must lower the error by a tenth. Degrees without a spare point, or whose fit `is_allowed` refuses,
/// are excluded; degree 0 is always allowed. Exception: two different points give a line where it is allowed.
/// In      x  in ascending order, equal values allowed
ChosenFit chosen_fit(std::span<const double> x, std::span<const double> y,
                     const std::function<bool(const haptics::Cubic&)>& is_allowed);

}  // namespace tandem::lab
