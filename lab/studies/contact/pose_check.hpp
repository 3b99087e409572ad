// Compares the contact search with an exhaustive search in random poses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "common/contact/contact_pair.hpp"
#include "lab/studies/contact/touch_object.hpp"

namespace tandem::lab {

struct PoseCheck {
  std::size_t poses = 0;
  /// number of points that the exhaustive search found deeper than 0.2 mm, over all poses
  std::size_t exact_points = 0;
  /// number of poses in which the contact search missed at least one of the exact_points
  std::size_t missed_poses = 0;
  double deepest_error_max_m = 0;
  std::uint64_t worst_pose = 0;  ///< number of the pose with deepest_error_max_m
  double deepest_max_m = 0;      ///< largest depth according to the exact surfaces
};

inline constexpr double kMissedDepth_m = 2e-4;
inline constexpr double kDeepestErrorBound_m = 1.5e-4;

/// Compares both searches in `poses` poses. In pose number i, A has a random orientation and overlaps B along a random
/// direction. The overlap depth is random, 0 to 1 mm. For thin walls it is at most 0.8 of the half thickness: twice the
/// rigid depth, from which contact is rigid. A pose depends only on `seed` and i.
///
/// Model   Rules of the comparison:
///         * An exact point counts as found if an active contact lies within two spacings plus the depth of the point.
///         * If there are more contacts than `budget`, the search merges points, and one contact represents several of
///           them. Such a contact counts at each of its points that is inside the other body.
///         * The largest exact depth is the larger of two values: the depth found by the exhaustive search, and the
///           exact depth at the deepest contact. The second is needed if a vertex pierces a face, because no vertex or
///           edge of the face may reach that depth
/// In      progress  called with the number of finished poses
/// Cost    about 0.1 s for each pose at 70,000 triangles
PoseCheck check_poses(const TouchObject& a, const TouchObject& b, std::size_t poses, std::uint64_t seed,
                      const std::function<void(std::size_t)>& progress = {},
                      std::uint32_t budget = contact::kContactBudget);

}  // namespace tandem::lab
