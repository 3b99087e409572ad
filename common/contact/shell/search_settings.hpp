// Tuned constants of the contact search.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tandem::contact {

/// Tuned constants of the search, each with the reason for its value. cut_node.hpp and SEARCH.md define the terms. A
/// depth in millimetres is the greatest depth in `tandem-lab bench contact` with the stated value. Constants without
/// such a number were not varied. Any change must be checked with that program, with its option `--landing`, and with
/// lab/make_contact_table.py.
struct SearchSettings {
  // Levels.

  /// A node nearer to the surface than this distance may be pressed into the other shape before its next query [m]. The
  /// leaves of such nodes are finer.
  double may_press_m = 2e-4;
  /// The leaves of nodes that may be pressed into the other shape (see may_press_m) are as small as the leaves of far
  /// nodes at a level lower by this number. At levels up to this number, they have 8 points.
  int finer_where_pressed = 4;
  /// Usual number of queries of a step, as a multiple of the capacity: 1 for each point, and 0.3 for the tree nodes
  /// above the points.
  double queries_per_candidate = 1.3;
  /// Band above which the motion counts as fast [m]. In fast motion, few bounds are still valid in the next step. Most
  /// near points are then not yet in contact.
  double wide_band_m = 1e-3;
  /// Number of consecutive steps with too many queries that are tolerated. The next such step begins a coarser level.
  std::uint32_t max_dense_steps = 4;
  /// Factors by which the limit of queries is raised if few points are near. The first one applies if the next coarser
  /// level has equally small leaves near the surface. The second one applies if that level has larger leaves and would
  /// lose accuracy.
  double query_margin = 1.3, query_margin_else = 2;
  /// Limits of the queries of one walk (traversal of the cut), as multiples of the usual queries of a step. The first
  /// is for a usual step, the second for the first step at a coarser level, the third for the first walk of a new pair.
  /// They bound the duration of the slowest step. If the band is wider than wide_band_m, the limits are doubled.
  std::uint32_t walk_queries = 4, new_level_queries = 8, first_cut_queries = 16;

  // Trials of a finer level.

  /// First and longest interval between trials [steps]. The interval doubles after each failed trial, because a trial
  /// costs one walk.
  std::uint32_t steps_per_try = 64, max_steps_per_try = 1024;
  /// Steps after which the finest level is tried if the near points are so few that they certainly fit into the
  /// capacity. The test ShellCut.IsFineSoonAfterAHardLanding requires a fine level within 20 steps after a hard
  /// landing.
  std::uint32_t steps_to_finest = 16;
  /// A finer level is tried if a count is below this fraction of the capacity:
  /// * finer_below: number of near points, at level 0
  /// * finer_level_below: number of contacts, at coarser levels. It is below 0.5, because a finer level may double the
  ///   contacts
  /// * finest_below: number of near points, for a trial of the finest level from any level
  double finer_below = 0.8, finer_level_below = 0.4, finest_below = 0.4;

  // Dividing of sampled nodes.

  /// Number of steps at a level before dividing begins. The number doubles, up to max_steps_per_try, each time the
  /// divided nodes exceed a capacity. After fast motion, the greatest depth of one mesh was 1.00 mm without dividing,
  /// and 0.55 mm with dividing.
  std::uint32_t steps_to_divide = 4;
  /// Fractions of the capacity and of the limit of the cut. Dividing starts only while the contacts and the entries of
  /// the cut are below these fractions, because the children of all sampled nodes may need twice as many.
  double divided_below = 0.4, divided_cut_below = 0.45;
  /// Queries by which the budget for dividing is reduced, for each point that the last walk queried.
  std::uint32_t queries_per_point = 2;

  // Joining of far nodes.

  /// Steps from the beginning of a level to the first joining, and between two joinings. With 64 steps, the greatest
  /// depth of one mesh was 0.86 mm.
  std::uint32_t steps_to_join = 100;
  /// Fraction of the limit of the cut above which far nodes are joined and dividing stops.
  double join_far_above = 0.45;
  /// Two nodes are joined if the bounds of both exceed the band by this distance [m]. With 1 mm, a mesh with needles
  /// among needles stayed at a coarse level, and its greatest depth was 0.78 mm; with 0.3 mm, it was 0.57 mm.
  double join_beyond_m = 3e-4;
  /// The two halves of a node are replaced by the node if the bounds of both allow a further motion of this fraction of
  /// the node's radius. The margin is needed because the node's ball is larger than those of its halves, and must be
  /// farther than the band, too. The fraction falls to zero as the cut fills up, and is zero for the first cut.
  float join_at = 0.5F;

  // Motion.

  /// Limit of the accumulated motion [m]. Bounds have single precision, so their rounding error is up to 15 nm at this
  /// value.
  double farthest_m = 0.25;
  /// Largest motion in a step that counts as slow [m]; 0.02 m/s at 1 kHz. Cached planes are then valid for five to ten
  /// steps.
  double slow_m = 2e-5;
  /// Motion of a part between two checks [m]: first and largest value. A check looks for two halves of a node that is
  /// above planes, and replaces them by that node. For example, small nodes that have passed a groove can become one
  /// large node again. A step checks at most one part, and share_of() spreads the checks over the steps. The motion
  /// doubles after a check that joined too little. The largest value is used if plane queries were omitted in fast
  /// motion.
  double halves_check_motion_m = 4e-3, max_halves_check_motion_m = 16e-3;

  // Plane queries.

  /// Flat nodes with more points than this are queried for planes at any level. Otherwise eight sampled points would
  /// represent such a node, with a large error. The greatest depth of one mesh was 1.17 mm with 128 points. That of
  /// another mesh was 1.95 mm with 1,024 points.
  std::uint32_t planes_above = 256;
  /// Motion after which nodes above planes are queried again [m]. share_of() spreads these queries over several steps.
  double plane_motion_m = 2e-4;
  /// A node that is above no plane is queried for planes again after a motion between half of this value and this value
  /// [m]. With two to three times this motion the search was faster, but steps of the force grew from 0.13 to 0.19 N.
  double no_planes_m = 6e-4;
  /// Plane queries assume that each point moves in any direction by at most this multiple of the accumulated motion of
  /// its part. For points inside the bounding ball of the solid, the accumulated motion itself is an upper bound of
  /// their motion. Near points may be slightly outside this ball.
  double sideways = 1.5;
  /// Minimum radius of a solid's bounding ball [m]. Smaller solids are not queried for planes, because points beside
  /// them move more than `sideways` assumes.
  double min_solid_m = 5e-3;
  /// Limits on the number of entries that new plane queries of a step may read from the field's table of planes. The
  /// first is for a usual step, the second for the first step of a level, the third for a first cut or a band above
  /// wide_band_m. One query of a grid takes up to some microseconds.
  std::size_t plane_queries = 400, new_level_plane_queries = 2500, first_plane_queries = 50'000;
};

inline constexpr SearchSettings kSearch;

}  // namespace tandem::contact
