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
/// Model   The depth of a point p below a plane with the normal n and the offset c is −(n·p + c). It is linear over a
///         flat node. Below several planes, the depth is the least of the depths. An area with a linear depth is
///         replaced exactly (force, moment and stiffness) by four contacts with a quarter of the area each, at its mean
///         ± deviations.
///         1. If a node has a polygon that the points cover evenly, the polygon is divided into parts with one nearest
///            plane each. Each part is divided into a pressing piece and a piece with a gap. The result is exact for
///            any pose, and continuous.
///         2. A node without a polygon is replaced as a whole if all its points press, if none presses, or if their
///            depths are nearly equal. Otherwise, its children are used.
///         3. The contacts are less deep than the deepest point of the node. If the difference exceeds some
///            micrometres, the node's children are used as long as `room` allows
struct PlaneContacts {
  const PointShell& shell;
  std::span<const FieldPlane> planes_F;
  Pose X_FP;
  Pose X_WP;
  Eigen::Matrix3d R_WF;
  double band_m = 0;         ///< gap up to which points become contacts
  double rigid_depth_m = 0;  ///< depth beyond which contact is as stiff as the step allows
  double share = 1;          ///< fraction of each point's area that counts
  double sign = 1;           ///< +1 or −1: factor of the planes' normals with which they point out of B
  std::uint32_t id_bits = 0;
  /// Number of contacts that may still be added. For each later node, least_contacts_of() are reserved in addition.
  std::size_t room = 0;
  /// Additional contacts that later nodes need to represent all planes below them. Their least_contacts_of() suffice
  /// for one plane.
  std::size_t more = 0;

  /// Appends the contacts of a node in the order of the points. While it runs, `contacts` needs capacity for kSmallNode
  /// more elements.
  void add(std::uint32_t node, PlaneSet planes, std::vector<ContactPoint>& contacts) noexcept;
};

}  // namespace tandem::contact
