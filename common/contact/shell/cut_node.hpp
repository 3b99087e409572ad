// What the cut through a shell's tree is made of.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/contact/shell_candidates.hpp"

namespace tandem::contact {

/// Flat nodes of more points are looked for planes below them at any level: a few of their points would hide too much.
inline constexpr std::uint32_t kPlanesAbove = 256;

/// A node of the cut.
struct ShellCandidates::CutNode {
  std::uint32_t node = 0;
  float asked_again_at_m = 0;  ///< when its part has gone that far, and the band is added
  PlaneSet planes = 0;         ///< it is above these, until then; without the band
  LeafLags lags = {};          ///< of a leaf's points that were asked: how much later each of them is asked again
  bool is_leaf = false;        ///< whose points were asked
  bool is_sampled = false;     ///< some of its points: what is known is enough at this level or a coarser one
  bool is_known(double gone_m, double band_m) const { return gone_m + (planes != 0 ? 0 : band_m) < asked_again_at_m; }
};

/// Less by as much as rounding could make it more.
inline float rounded_down(double a) {
  constexpr double kFar = 100;
  const double least = std::min(a, kFar);
  return static_cast<float>(least - std::numeric_limits<float>::epsilon() * std::abs(least));
}

/// 0.5 to 1, of each node another.
inline double share_of(std::uint32_t node) {
  return 0.5 + 0x1.0p-33 * (node * 2654435769U);
}

}  // namespace tandem::contact
