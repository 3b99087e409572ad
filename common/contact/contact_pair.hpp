// Where two shapes touch: found 1000 times a second, with the work bounded, from what was found before.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/contact/contact_shape.hpp"

namespace tandem {

/// One place where A meets B.
struct ContactPoint {
  Vec3 p_W = Vec3::Zero();
  Vec3 normal_W = Vec3::UnitZ();  ///< unit, out of B towards A: the force on A is along it
  double depth_m = 0;             ///< overlap along the normal; negative: a gap
  double area_m2 = 0;
  Vec3 bristle_W = Vec3::Zero();  ///< tangential displacement of A past B since they stuck; written by the solver
  std::uint32_t id = 0;           ///< which sample it is: the same from step to step
};

/// In points asked of a distance field and nodes of a tree, never in time: a replay degrades alike.
struct ContactBudget {
  std::uint32_t points = 2048;  ///< a pair and step; beyond it, points are merged with their neighbours
};

/// What a search had to do.
struct ContactWork {
  std::uint32_t nodes = 0;
  std::uint32_t points = 0;
  bool is_coarse = false;     ///< the budget was reached: points stand for several
  bool is_refreshed = false;  ///< the tree was walked
};

/// The contacts of shape A with shape B, searched each step. Remembers the candidates of the last walk of the tree and
/// how far the shapes may move before they are not enough.
///
/// Model   all surface points of the shape with the smaller surface against the distance field of the other, and the
///         feature points of the other against the field of the first
/// Thread  one at a time
class ContactPair {
 public:
  /// All memory for `budget` is taken here.
  explicit ContactPair(const ContactBudget& budget);

  /// Forgets everything and looks at these shapes from now on. Null: none. No allocation.
  void bind(const ContactShape* a, const ContactShape* b) noexcept;
  bool is_bound() const;

  /// Finds every point deeper than −`band_m`. Bristles of points that were there before are carried along with B.
  ContactWork find(const Pose& X_WA, const Pose& X_WB, double band_m) noexcept;

  /// Of the last find(), in the order of their ids.
  std::span<ContactPoint> contacts() noexcept;
  std::span<const ContactPoint> contacts() const noexcept;
};

}  // namespace tandem
