// Least-squares polynomials of few points, and how many coefficients the points can carry.
#pragma once

#include <functional>
#include <span>

#include "common/haptics/coupling/adaptive.hpp"

namespace tandem::lab {

/// Of the given degree, 0 to 3, through at least degree + 1 points.
haptics::Cubic least_squares(std::span<const double> x, std::span<const double> y, int degree);

struct ChosenFit {
  haptics::Cubic cubic;
  int degree = 0;
  double left_out_rms = 0;  ///< error at points that the fit was not shown, one at a time; 0 for two or one
};

/// The degree, 0 to 3, whose fits miss left-out points least, the first and the last always kept in; a higher one has
/// to lower that by a tenth. Degrees that leave no point over, or whose fit `is_allowed` refuses, do not count; degree
/// 0 always does. Two points that differ are the exception: a line where it is allowed.
/// In      x  not falling
ChosenFit chosen_fit(std::span<const double> x, std::span<const double> y,
                     const std::function<bool(const haptics::Cubic&)>& is_allowed);

}  // namespace tandem::lab
