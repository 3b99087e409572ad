// Results of the search in a shell: candidates for contacts, the number of contacts that they need, and the work of the
// search.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/points/point_shell.hpp"

namespace tandem::contact {

/// Amount of work that a search did: numbers of queried nodes and points.
struct ContactWork {
  std::uint32_t nodes = 0;
  std::uint32_t points = 0;
  bool is_coarse = false;     ///< true: points were merged, because the budget does not suffice for single points
  bool is_refreshed = false;  ///< true: the field was queried; false: the last step's result is still valid

  std::uint32_t queries() const { return nodes + points; }
  ContactWork& operator+=(const ContactWork& other) {
    nodes += other.nodes;
    points += other.points;
    is_coarse = is_coarse || other.is_coarse;
    is_refreshed = is_refreshed || other.is_refreshed;
    return *this;
  }
};

/// A candidate for contact: one point of the shell, several merged points, or a node above planes of the field.
struct ShellCandidate {
  Eigen::Vector3f p_P = Eigen::Vector3f::Zero();
  float area_m2 = 0;
  double distance_m = 0;            ///< distance to the field's surface at this pose; unused for nodes above planes
  Vec3 gradient_F = Vec3::UnitZ();  ///< gradient of the field at this pose; length about 1
  std::uint32_t first = 0;
  std::uint32_t count = 0;  ///< number of points that the candidate represents, beginning with the point `first`
  std::uint32_t node = 0;   ///< index of the node that lies above planes; unused for points
  PlaneSet planes = 0;      ///< planes above which the node lies; none for points
};

/// Nodes with at most this number of points are small. Above a plane, a small node gives one pressing contact and one
/// with a gap. A larger node gives four of each.
inline constexpr std::uint32_t kSmallNode = 32;
inline constexpr std::size_t kMaxNodeContacts = 8;
inline constexpr std::size_t kLeafContacts = 2;
/// Returns the number of contacts that a node above planes needs at least.
inline std::size_t least_contacts_of(const ShellNode& node) {
  return node.count > kSmallNode ? kMaxNodeContacts : kLeafContacts;
}

}  // namespace tandem::contact
