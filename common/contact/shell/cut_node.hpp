// Data of the cut through a shell's tree: its entries, its parts, and the state of one traversal. The tree divides the
// shell's points; each inner node has two halves (children). Terms:
// * Cut: a set of nodes that together contain each point once. The first cut is that of the first search after bind().
// * Walk: one traversal of the cut.
// * Level: determines the size of leaves (level_policy.hpp).
// * Leaf: a node whose points are sampled singly.
// * Sampled node: a leaf of which only eight points are sampled.
// * Dividing: replacing a sampled node by its children.
// * Node above planes: a node that lies over flat faces (planes) of the other shape.
// * Band: distance below which points count as near.
// * Pressing point: a point inside the other shape, that is, at a negative distance.
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
  /// The node must be queried again when accumulated motion + band reaches this value.
  float query_again_at_m = 0;
  /// Planes above which the node lies, valid until its next query. If there are any, query_again_at_m is compared with
  /// the accumulated motion alone, without the band.
  PlaneSet planes = 0;
  LeafLags lags = {};    ///< for each point of a sampled leaf: additional motion until its next query
  bool is_leaf = false;  ///< true: the node is used as a leaf, and its points were sampled
  /// True: only eight of the node's points were sampled. That suffices at the current level and at coarser ones.
  bool is_sampled = false;

  /// Returns an entry for a node that has no bound yet.
  static CutNode unknown(std::uint32_t node) {
    return {.node = node, .query_again_at_m = -std::numeric_limits<float>::infinity()};
  }
  bool is_known(double moved_m, double band_m) const { return moved_m + (planes != 0 ? 0 : band_m) < query_again_at_m; }
};

/// A subtree of the shell's tree, with the entries of the cut that belong to it. Each part has a motion of its own.
/// When the shape turns, the points of a small part move little relative to the part's centre. The bound of their
/// motion is therefore smaller than for the whole shape.
struct CutPart {
  std::uint32_t node = 0;  ///< root of the subtree
  std::uint32_t begin = 0, count = 0;
  double moved_m = 0;           ///< accumulated motion: upper bound of the approach of the part's points
  double step_motion_m = 0;     ///< motion of the last step, which is included in moved_m
  double query_again_at_m = 0;  ///< least query_again_at_m of the part's nodes
  /// Accumulated motion at the next check for two halves of a node that is above planes. The node replaces the halves.
  double halves_check_at_m = 0;
  double halves_check_after_m = 0;  ///< motion between that check and the one after it
  bool has_open_question = false;   ///< true: a plane query was omitted; the next check queries the whole part again
  bool waits_for_rest = false;      ///< true: the next check is postponed until the part moves slowly, or has moved far
  bool has_sampled = false;         ///< true: some nodes of the part may be sampled (by eight of their points)

  /// Makes the next walk query the part, because one of the part's nodes has no bound.
  void query_now() { query_again_at_m = -std::numeric_limits<double>::infinity(); }
};

/// State of one walk (traversal of the cut).
struct WalkState {
  ContactWork work;                  ///< work of all walks of the step
  std::uint32_t query_limit = 0;     ///< limit of work.queries()
  std::uint32_t divide_queries = 0;  ///< remaining queries for dividing sampled nodes
  std::uint32_t divide_points = 0;   ///< points queried by dividing
  /// True: one part may still be checked in this walk for halves that their parent can replace (see halves_check_at_m).
  bool may_check_halves = false;

  // The following members belong to the part that is being traversed.
  std::uint32_t root = 0;     ///< root of the part
  float first_at_m = 0;       ///< least accumulated motion at which one of the kept nodes must be queried again
  bool divides_part = false;  ///< true: sampled nodes of this part are being divided
  bool has_sampled = false;   ///< true: the new cut of this part has a sampled node
};

/// Rounds a bound down to single precision, so that rounding never makes it too large. Bounds above 100 m are reduced
/// to slightly below 100 m.
inline float rounded_down(double a) {
  constexpr double kFar = 100;
  const double least = std::min(a, kFar);
  return static_cast<float>(least - std::numeric_limits<float>::epsilon() * std::abs(least));
}

/// Returns a pseudo-random number from 0.5 to 1 that is constant for a node. Intervals between queries are multiplied
/// by this number, so that the queries of many nodes are spread over several steps.
inline double share_of(std::uint32_t node) {
  return 0.5 + 0x1.0p-33 * (node * 2654435769U);
}

}  // namespace tandem::contact
