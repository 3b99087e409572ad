// Data of the cut through a shell's tree: its entries, the parts into which it is divided, and the state of a walk
// along it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/shell/leaf_samples.hpp"
#include "common/contact/shell/shell_candidate.hpp"

namespace tandem::contact {

/// An entry of the cut: a node of the tree, with a bound of the distances of its points.
struct CutNode {
  std::uint32_t node = 0;
  float query_again_at_m = 0;  ///< value of motion plus band at which the node is queried again
  PlaneSet planes = 0;         ///< planes below the node until its next query; with planes, the band is ignored
  LeafLags lags = {};          ///< additional motion until each point of a sampled leaf is queried
  bool is_leaf = false;        ///< the node is treated as a leaf: its points were sampled
  bool is_sampled = false;     ///< only eight of its points were sampled; sufficient at this level or a coarser one

  /// Returns an entry for a node that has no bound yet.
  static CutNode unknown(std::uint32_t node) {
    return {.node = node, .query_again_at_m = -std::numeric_limits<float>::infinity()};
  }
  bool is_known(double moved_m, double band_m) const { return moved_m + (planes != 0 ? 0 : band_m) < query_again_at_m; }
};

/// A subtree of the shell's tree, with the entries of the cut that belong to it. Each part accumulates its own motion.
/// When the shape turns, points of a small part move little relative to the part's centre, so the bound of the motion
/// is tight.
struct CutPart {
  std::uint32_t node = 0;  ///< root of the subtree
  std::uint32_t begin = 0, count = 0;
  double moved_m = 0;               ///< accumulated motion: upper bound of the approach of the part's points
  double step_motion_m = 0;         ///< motion of the last step, which is included in moved_m
  double query_again_at_m = 0;      ///< least query_again_at_m of the part's nodes
  double halves_check_at_m = 0;     ///< accumulated motion at the next check for pairs of nodes to join above planes
  double halves_check_after_m = 0;  ///< motion between the next check and the check after it
  bool has_open_question = false;   ///< some node was not queried for planes; the next check renews the whole part
  bool waits_for_rest = false;      ///< the next check is postponed until the part is slow or has moved far
  bool has_sampled = false;         ///< true if the part may have sampled nodes (eight points represent all points)

  /// Requires a query of the part in the next walk, because one of its nodes has no bound.
  void query_now() { query_again_at_m = -std::numeric_limits<double>::infinity(); }
};

/// State of a walk along the cut.
struct WalkState {
  ContactWork work;                  ///< work of all walks of the step
  std::uint32_t query_limit = 0;     ///< limit of work.queries()
  std::uint32_t divide_queries = 0;  ///< remaining queries for dividing sampled nodes
  std::uint32_t divide_points = 0;   ///< points queried by dividing
  bool may_check_halves = false;     ///< this walk may still check one part for pairs of nodes to join above planes

  // State of the walk in the current part.
  std::uint32_t root = 0;     ///< root of the part
  float first_at_m = 0;       ///< least motion at which a kept node is queried again
  bool divides_part = false;  ///< sampled nodes of the part are divided
  bool has_sampled = false;   ///< the part's new cut has a sampled node
};

/// Converts to single precision, reduced by the largest rounding error.
inline float rounded_down(double a) {
  constexpr double kFar = 100;
  const double least = std::min(a, kFar);
  return static_cast<float>(least - std::numeric_limits<float>::epsilon() * std::abs(least));
}

/// Returns a pseudo-random number from 0.5 to 1 that is constant for a node. Intervals between queries are multiplied
/// by it. The queries of many nodes are thus spread over several steps.
inline double share_of(std::uint32_t node) {
  return 0.5 + 0x1.0p-33 * (node * 2654435769U);
}

}  // namespace tandem::contact
