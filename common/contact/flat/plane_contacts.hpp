// The contacts of flat nodes of a shell with planes of a field: few points that act as all of them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/distance_field.hpp"

namespace tandem::contact {

struct ContactPoint;
struct PointShell;
struct ShellNode;

/// Nodes of more points have four contacts that press on a plane and four that do not; smaller ones have one of each.
inline constexpr std::uint32_t kSmallNode = 32;
inline constexpr std::size_t kMaxNodeContacts = 8;
inline constexpr std::size_t kLeafContacts = 2;
/// What must be left for a node above planes.
std::size_t least_contacts_of(const ShellNode& node);

/// Points of a shell (frame P) on planes of a field (frame F), of one node after the other.
///
/// Model   a point's depth below a plane is −(n·p + c): linear over a node; below several, the least. Four contacts with a
///         quarter of an area each, at its mean ± deviations, have the same force, moment and stiffness as all of the
///         area. A node that covers a rectangle evenly is cut into the polygons where each plane is the nearest and
///         presses, or does not yet: exact for any pose, and continuous. Of others the whole counts, where all of it
///         presses or none, or where all depths are alike; else they are divided. What a node hides is how deep its
///         deepest point is: where that is more than some micrometres, it is divided as long as there is room
struct PlaneContacts {
  const PointShell& shell;
  std::span<const FieldPlane> planes_F;
  Pose X_FP;
  Pose X_WP;
  Eigen::Matrix3d R_WF;
  double band_m = 0;
  double rigid_depth_m = 0;
  double share = 1;  ///< of the points' area
  double sign = 1;   ///< of the normals
  std::uint32_t id_bits = 0;
  std::size_t room = 0;  ///< for more contacts than least_contacts_of() each node that comes
  std::size_t more = 0;  ///< that those nodes should have for all planes below them

  /// Appends to `contacts`, in the order of the points; while it runs, up to kSmallNode more than it leaves.
  void add(std::uint32_t node, PlaneSet planes, std::vector<ContactPoint>& contacts) noexcept;
};

}  // namespace tandem::contact
