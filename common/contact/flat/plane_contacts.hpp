// Contacts of a shell's flat nodes with planes of a field: few contacts that represent all points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/field/distance_field.hpp"

namespace tandem::contact {

struct ContactPoint;
struct PointShell;

/// Contacts of a shell's points (frame P) with planes of a field (frame F), one node at a time.
///
/// Model   The depth of a point below a plane is −(n·p + c), which is linear over a node; below several planes it is
///         the least. Four contacts with a quarter of an area each, at its mean ± deviations, have the same force,
///         moment and stiffness as the whole area. A node that covers a polygon evenly is cut into the polygons where
///         each plane is the nearest and presses, or does not press yet: exact for any pose, and continuous. Other
///         nodes count as a whole where all points press, or none, or where all depths are nearly equal; else they are
///         divided. The contacts of a node are less deep than its deepest point. Where the difference exceeds some
///         micrometres, the node is divided while there is room
struct PlaneContacts {
  const PointShell& shell;
  std::span<const FieldPlane> planes_F;
  Pose X_FP;
  Pose X_WP;
  Eigen::Matrix3d R_WF;
  double band_m = 0;         ///< gap up to which points become contacts
  double rigid_depth_m = 0;  ///< depth beyond which contact is as stiff as the step allows
  double share = 1;          ///< fraction of the points' area that counts
  double sign = 1;           ///< factor ±1 of the planes' normals; the normals of contacts point out of B
  std::uint32_t id_bits = 0;
  std::size_t room = 0;  ///< contacts that may be added beyond least_contacts_of() for each later node
  std::size_t more = 0;  ///< number of additional contacts that these nodes need to represent all planes below them

  /// Appends contacts in the order of the points. While it runs, `contacts` needs capacity for kSmallNode more
  /// elements.
  void add(std::uint32_t node, PlaneSet planes, std::vector<ContactPoint>& contacts) noexcept;
};

}  // namespace tandem::contact
