// Comparison of the contact search with an exhaustive search in random poses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "common/contact/contact_pair.hpp"
#include "lab/studies/contact/touch_object.hpp"

namespace tandem::lab {

struct PoseCheck {
  std::size_t poses = 0;
  std::size_t exact_points = 0;  ///< points of the exhaustive search deeper than 0.2 mm, over all poses
  std::size_t missed_poses = 0;  ///< poses with such a point and no contact near it
  double deepest_error_max_m = 0;
  std::uint64_t worst_pose = 0;  ///< pose of deepest_error_max_m
  double deepest_max_m = 0;      ///< largest depth by the exact surfaces
};

inline constexpr double kMissedDepth_m = 2e-4;
inline constexpr double kDeepestErrorBound_m = 1.5e-4;

/// Pose number i has a random orientation of A and overlaps B by a random 0 to 1 mm along a random direction. Where a
/// wall is thin, the overlap is at most 0.8 of its half thickness: twice the depth from which contact is rigid. The
/// pose depends on `seed` and i alone.
///
/// Model   An exact point counts as found when a pressing contact lies within two spacings plus its own depth. A
///         contact that represents several points, as beyond the budget, counts at each of these points that is
///         inside. The depth of the deepest contact by the exact surfaces counts as well: where a corner pierces a
///         face, no corner or edge reaches that depth
/// In      progress  called with the number of poses done
/// Cost    about 0.1 s a pose for 70,000 triangles
PoseCheck check_poses(const TouchObject& a, const TouchObject& b, std::size_t poses, std::uint64_t seed,
                      const std::function<void(std::size_t)>& progress = {},
                      std::uint32_t budget = contact::kContactBudget);

}  // namespace tandem::lab
