// The search for contacts, held against an exhaustive one in random poses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "common/contact/contact_pair.hpp"
#include "lab/studies/contact/touch_object.hpp"

namespace tandem::lab {

struct PoseCheck {
  std::size_t poses = 0;
  std::size_t exact_points = 0;  ///< of the exhaustive search, deeper than 0.2 mm, in all poses
  std::size_t missed_poses = 0;  ///< with such a point and no contact near it
  double deepest_error_max_m = 0;
  std::uint64_t worst_pose = 0;  ///< where deepest_error_max_m was
  double deepest_max_m = 0;      ///< by the exact surfaces
};

inline constexpr double kMissedDepth_m = 2e-4;
inline constexpr double kDeepestErrorBound_m = 1.5e-4;

/// Pose number i has a random orientation of A and overlaps B by a random 0 to 1 mm along a random direction, where a
/// wall is thin by 0.8 of its half at most: twice the depth from which contact is rigid; it depends on `seed` and i alone.
///
/// Model   An exact point counts as found when a contact that presses lies within two spacings and its own depth of it. One that
///         stands for several points, as beyond the budget, lies at each of these that is inside.
///         How deep the deepest contact is by the exact surfaces counts as well: of a face that a corner is through, no corner or
///         edge is as deep
/// In      progress  called with the number of poses done
/// Cost    some 0.1 s a pose for 70,000 triangles
PoseCheck check_poses(const TouchObject& a, const TouchObject& b, std::size_t poses, std::uint64_t seed,
                      const std::function<void(std::size_t)>& progress = {},
                      std::uint32_t budget = contact::kContactBudget);

}  // namespace tandem::lab
