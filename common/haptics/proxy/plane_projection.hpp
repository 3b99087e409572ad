// Finds the point above several planes that is nearest to a goal. Every step of the proxy solves this optimisation.
#pragma once

#include <array>
#include <span>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Half-space above a plane: n·x ≥ offset.
struct AllowedSide {
  Vec3 normal = Vec3::UnitZ();  ///< unit vector
  double offset_m = 0;

  double height_m(const Vec3& p) const { return normal.dot(p) - offset_m; }
};

/// Finds the point nearest to a goal that lies above several planes. Planes are added one at a time.
///
/// Model   min |x − g|² subject to n_i·x ≥ o_i, with the goal g and planes with the normals n_i and offsets o_i. The
///         solution is x = g + Σ λ_i n_i with at most three active planes and λ_i ≥ 0
/// Source  Zilles & Salisbury, "A constraint-based god-object method for haptic display", IROS 1995, with the same
///         three Lagrange multipliers. The proof of termination is ours:
///         1. The new active planes are among the old active planes and the added one (an LP-type problem; Matoušek,
///            Sharir, Welzl 1996). It therefore suffices to try seven sets of planes.
///         2. Adding a violated plane always moves x away from the goal. Therefore no set of active planes repeats, and
///            the algorithm terminates.
class PlaneProjection {
 public:
  struct Active {
    AllowedSide side;
    int tag = 0;        ///< identifier chosen by the caller
    double load_m = 0;  ///< λ_i: distance by which this plane pushes x along its normal, away from the goal
  };

  void start(const Vec3& goal) noexcept {
    goal_ = goal;
    point_ = goal;
    count_ = 0;
  }
  /// Adds a plane. Returns false and changes nothing if, up to rounding errors, no point is above this plane and all
  /// active ones.
  bool add(const AllowedSide& side, int tag) noexcept;

  const Vec3& goal() const { return goal_; }
  const Vec3& point() const { return point_; }
  std::span<const Active> active() const { return {active_.data(), count_}; }

 private:
  bool try_set(std::span<const Active> planes, unsigned chosen) noexcept;

  Vec3 goal_ = Vec3::Zero();
  Vec3 point_ = Vec3::Zero();
  std::array<Active, 3> active_;
  std::size_t count_ = 0;
};

}  // namespace tandem::haptics
