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
/// Model   The depth of a point p below a plane with the normal n and the offset c is −(n·p + c), which is linear over
///         a flat node. Below several planes, the depth is the least of these. Four contacts with a quarter of an area
///         each, at its mean ± deviations, have the same force, moment and stiffness as the whole area.
///         1. A polygon that the points cover evenly is divided into parts with one nearest plane each. Each part is
///            divided into a pressing piece and a piece with a gap. The result is exact for any pose, and continuous.
///         2. A node without a polygon is used whole if all points press, if none presses, or if all depths are nearly
///            equal. Otherwise it is divided.
///         3. The contacts of a node are less deep than its deepest point. If the difference exceeds some micrometres,
///            the node is divided as long as `room` allows
struct PlaneContacts {
  const PointShell& shell;
  std::span<const FieldPlane> planes_F;
  Pose X_FP;
  Pose X_WP;
  Eigen::Matrix3d R_WF;
  double band_m = 0;         ///< gap up to which points become contacts
  double rigid_depth_m = 0;  ///< depth beyond which contact is as stiff as the step allows
  double share = 1;          ///< fraction of each point's area that counts
  double sign = 1;           ///< factor ±1 of the planes' normals; the normals of contacts point out of B
  std::uint32_t id_bits = 0;
  std::size_t room = 0;  ///< limit of the contacts to add, beyond least_contacts_of() for each later node
  std::size_t more = 0;  ///< additional contacts that later nodes would need to represent all planes below them

  /// Appends contacts in the order of the points. `contacts` temporarily needs capacity for kSmallNode additional
  /// elements.
  void add(std::uint32_t node, PlaneSet planes, std::vector<ContactPoint>& contacts) noexcept;
};

}  // namespace tandem::contact
