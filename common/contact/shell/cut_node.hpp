// Node of the cut through a shell's tree.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/shell/leaf_samples.hpp"

namespace tandem::contact {

/// Flat nodes with more points than this are queried for planes below them at any level. As a sampled leaf, such a node
/// would have only eight samples for all of its points.
inline constexpr std::uint32_t kPlanesAbove = 256;

/// An entry of the cut: a node of the tree, and what is known about the distance of its points.
struct CutNode {
  std::uint32_t node = 0;
  float query_again_at_m = 0;  ///< value of motion plus band at which the node is queried again
  PlaneSet planes = 0;         ///< planes below the node until its next query; if there are any, the band is ignored
  LeafLags lags = {};          ///< additional motion until each point of a sampled leaf is queried
  bool is_leaf = false;        ///< the node is treated as a leaf: its points were sampled
  bool is_sampled = false;     ///< only eight of its points were sampled; sufficient at this level or a coarser one
  bool is_known(double moved_m, double band_m) const { return moved_m + (planes != 0 ? 0 : band_m) < query_again_at_m; }
};

/// Converts to single precision, reduced by the largest rounding error.
inline float rounded_down(double a) {
  constexpr double kFar = 100;
  const double least = std::min(a, kFar);
  return static_cast<float>(least - std::numeric_limits<float>::epsilon() * std::abs(least));
}

/// Returns a pseudo-random number from 0.5 to 1, the same in each step for a node. Intervals between queries are
/// multiplied by it, so that queries of many nodes do not occur in one step.
inline double share_of(std::uint32_t node) {
  return 0.5 + 0x1.0p-33 * (node * 2654435769U);
}

}  // namespace tandem::contact
