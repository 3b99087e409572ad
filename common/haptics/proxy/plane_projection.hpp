// Where a point goes that is drawn to a goal and held back by planes: the small problem inside every step of the proxy.
#pragma once

#include <array>
#include <span>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// What lies above a plane: n·x ≥ offset.
struct AllowedSide {
  Vec3 normal = Vec3::UnitZ();  ///< unit
  double offset_m = 0;

  double height_m(const Vec3& p) const { return normal.dot(p) - offset_m; }
};

/// The point nearest to a goal that is above several planes, found by adding one plane at a time.
///
/// Model   min |x − g|² with n_i·x ≥ o_i; x = g + Σ λ_i n_i over at most three active planes, λ_i ≥ 0
/// Source  Zilles & Salisbury, "A constraint-based god-object method for haptic display", IROS 1995, whose three
///         Lagrange multipliers these are. Ours: adding a plane that x violates only ever moves x away from the goal,
///         and its new active planes are among the old ones and the added one (a problem of LP type; Matoušek, Sharir,
///         Welzl 1996), so that seven cases cover it, no set of planes comes twice, and adding ends.
class PlaneProjection {
 public:
  struct Active {
    AllowedSide side;
    int tag = 0;        ///< the caller's
    double load_m = 0;  ///< λ: how hard the goal pulls against it
  };

  void start(const Vec3& goal) noexcept {
    goal_ = goal;
    point_ = goal;
    count_ = 0;
  }
  /// False: no point is above this plane and the active ones, or only one that rounding hides. Nothing changes then.
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
