// Cut through a shell's tree: its nodes, the parts into which it is divided, and the state of a walk along it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/shell/leaf_samples.hpp"
#include "common/contact/shell/shell_candidate.hpp"

namespace tandem::contact {

/// A node of the cut.
struct CutNode {
  std::uint32_t node = 0;
  float query_again_at_m = 0;  ///< accumulated motion of its part, plus the band, at the next query
  PlaneSet planes = 0;         ///< planes below the node, valid until the next query; for them the band does not count
  LeafLags lags = {};          ///< for a sampled leaf: additional motion until each point is queried
  bool is_leaf = false;        ///< its points were sampled
  bool is_sampled = false;     ///< only some of its points were sampled: enough at this level or a coarser one

  /// A node without a bound.
  static CutNode unknown(std::uint32_t node) {
    return {.node = node, .query_again_at_m = -std::numeric_limits<float>::infinity()};
  }
  bool is_known(double moved_m, double band_m) const { return moved_m + (planes != 0 ? 0 : band_m) < query_again_at_m; }
};

/// A subtree of the shell and its piece of the cut. Each part has its own motion, because its points move little
/// relative to its centre when the shape turns.
struct CutPart {
  std::uint32_t node = 0;  ///< root of the subtree
  std::uint32_t begin = 0, count = 0;
  double moved_m = 0;               ///< accumulated motion, an upper bound of the approach of each of its points
  double step_motion_m = 0;         ///< motion of the last step, which is included in moved_m
  double query_again_at_m = 0;      ///< least query_again_at_m of its nodes
  double halves_check_at_m = 0;     ///< accumulated motion at the next check for halves to join above planes
  double halves_check_after_m = 0;  ///< motion between that check and the one after
  bool has_open_question = false;   ///< some node was not queried for planes; the next check rebuilds the part's cut
  bool waits_for_rest = false;      ///< that check waits until the part is slow or has moved far
  bool has_sampled = false;         ///< it may have sampled nodes, of which eight points represent all points

  /// Requires a query of the part in the next walk, because a node of it has no bound.
  void query_now() { query_again_at_m = -std::numeric_limits<double>::infinity(); }
};

/// State of a walk along the cut.
struct WalkState {
  ContactWork work;                  ///< work of all walks of the step
  std::uint32_t query_limit = 0;     ///< limit of work.queries()
  std::uint32_t divide_queries = 0;  ///< remaining queries for dividing sampled nodes
  std::uint32_t divide_points = 0;   ///< points queried by dividing
  bool may_check_halves = false;     ///< this walk may still check a part for halves to join above planes

  // State of the part that is being walked.
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

/// Pseudo-random share of 0.5 to 1, constant for each node, which spreads queries over steps.
inline double share_of(std::uint32_t node) {
  return 0.5 + 0x1.0p-33 * (node * 2654435769U);
}

}  // namespace tandem::contact
