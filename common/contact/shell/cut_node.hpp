// Node of the cut through a shell's tree.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/shell/leaf_samples.hpp"

namespace tandem::contact {

/// Flat nodes with more points than this are queried for planes at any level, because eight sampled points would not
/// represent so many.
inline constexpr std::uint32_t kPlanesAbove = 256;

/// A node of the cut.
struct CutNode {
  std::uint32_t node = 0;
  float query_again_at_m = 0;  ///< accumulated motion of its part, plus the band, at the next query
  PlaneSet planes = 0;         ///< planes below the node, valid until the next query; for them the band does not count
  LeafLags lags = {};          ///< for a sampled leaf: additional motion until each point is queried
  bool is_leaf = false;        ///< its points were sampled
  bool is_sampled = false;     ///< only some of its points were sampled: enough at this level or a coarser one
  bool is_known(double moved_m, double band_m) const { return moved_m + (planes != 0 ? 0 : band_m) < query_again_at_m; }
};

/// Converts to single precision, reduced by the largest rounding error.
inline float rounded_down(double a) {
  constexpr double kFar = 100;
  const double least = std::min(a, kFar);
  return static_cast<float>(least - std::numeric_limits<float>::epsilon() * std::abs(least));
}

/// Pseudo-random share of 0.5 to 1, constant for each node, which spreads queries over steps.
inline double share_of(std::uint32_t node) {
  return 0.5 + 0x1.0p-33 * (node * 2654435769U);
}

}  // namespace tandem::contact
