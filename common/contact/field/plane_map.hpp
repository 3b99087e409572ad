// Regions where a sampled distance field equals the distance to planes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/contact/field/distance_field.hpp"

namespace tandem::contact {

/// Stores, for blocks of a lattice, a set of planes that replaces the field there: in the block, the field equals the
/// largest distance to these planes. Blocks without such a set have the value kNone. A block is a cube with 1/8 of the
/// edge of a brick; bricks are the cubes of the lattice.
///
/// Thread  any number of threads at the same time
class PlaneMap {
 public:
  static constexpr std::uint32_t kBlocks = 8;  ///< blocks along an edge of a brick
  /// Special values of a block. A larger value is the index of a set of planes.
  static constexpr std::uint8_t kNone = 0;
  static constexpr std::uint8_t kOutside = 1;  ///< the block is far outside of all surfaces
  static constexpr std::uint8_t kInside = 2;   ///< the block is deeper inside the shape than any contact
  static constexpr double kDeep_m = 1e-3;      ///< depth that no contact reaches: contact becomes rigid at 0.5 mm
  using Blocks = std::array<std::uint8_t, std::size_t{kBlocks} * kBlocks * kBlocks>;
  /// Largest number of planes of a block: the three that meet in a corner.
  static constexpr int kMaxInBlock = 3;
  /// Largest number of planes that a query for a box returns: for example a face, its four sides, and the opposite
  /// face.
  static constexpr int kMaxInBox = 6;

  PlaneMap() = default;
  PlaneMap(std::vector<FieldPlane> planes, const Vec3& origin_S, const std::array<std::uint32_t, 3>& bricks,
           double brick_m);

  /// Returns the index of a set of planes, and stores the set if it is new. Returns kNone if there are too many sets to
  /// store.
  std::uint8_t index_of(PlaneSet set);
  /// Stores the blocks of a brick. Call it once for each brick that has a block other than kNone, in any order.
  void set(std::size_t brick, const Blocks& blocks);

  std::span<const FieldPlane> planes() const { return planes_; }
  /// See DistanceField::planes_over().
  PlaneSet planes_over(const OrientedBox& box_S, std::size_t& queries) const noexcept;
  /// See DistanceField::planes_at().
  PlaneSet planes_at(const Vec3& p_S) const noexcept { return planes_.empty() ? 0 : sets_[at(p_S)]; }
  std::size_t memory_bytes() const;

 private:
  struct Range;
  Range range_of(const OrientedBox& box_S, double edge_m) const noexcept;
  std::uint8_t at(const Vec3& p_S) const noexcept;
  template <typename OfBrick, typename OfBlock>
  bool for_blocks(const OrientedBox& box_S, const OfBrick& of_brick, const OfBlock& of_block) const noexcept;
  PlaneSet harmless_in(std::uint8_t index, const Vec3& middle, double edge_m) const;
  Vec3 middle_of(std::size_t brick) const;
  bool is_largest(PlaneSet all, std::uint8_t index, const Vec3& middle, double edge_m) const noexcept;
  bool is_largest_at(PlaneSet all, std::uint8_t index, const Vec3& p_S) const noexcept;
  bool is_above_some(PlaneSet set, const Vec3& middle, const Vec3& half_m) const noexcept;
  bool is_deep(PlaneSet set, const Vec3& middle, double edge_m) const noexcept;
  bool is_right_beyond(PlaneSet set, const OrientedBox& box_S) const noexcept;
  bool is_below(PlaneSet others, PlaneSet set, const Vec3& middle, double edge_m) const noexcept;

  std::vector<FieldPlane> planes_;
  std::vector<PlaneSet> sets_;
  Vec3 origin_S_ = Vec3::Zero();
  std::array<std::uint32_t, 3> bricks_ = {0, 0, 0};
  double brick_m_ = 1;
  /// Content of each brick: the common value of its blocks; if they differ, kFirstMixed + index in mixed_.
  std::vector<std::uint32_t> refs_;
  /// For a brick that has one set of planes: further planes that a query may add without a change of its result,
  /// because everywhere in the brick some plane of the set is at least as distant. For a brick far outside: the planes
  /// above which the whole brick lies.
  std::vector<PlaneSet> harmless_;
  std::vector<Blocks> mixed_;  ///< blocks of the bricks whose blocks have different values
  static constexpr std::uint32_t kFirstMixed = 256;
};

}  // namespace tandem::contact
