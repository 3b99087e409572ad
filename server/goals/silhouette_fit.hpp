// Fit of several boards to a figure, seen from above.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/geometry/polygon.hpp"
#include "server/assets/scene_goals.hpp"

namespace tandem::server {

using geometry::Vec2;

/// A figure on the plane, and the bodies whose outlines must cover it.
struct SilhouettePlan {
  struct Piece {
    std::size_t body = 0;
    std::vector<Vec2> outline;  ///< convex, in the xy plane of the body
  };
  std::vector<Piece> pieces;
  std::vector<geometry::Triangle2> figure;  ///< triangles
  double figure_area_m2 = 0;
  Vec2 figure_centre = Vec2::Zero();
  double covered = 0.95;  ///< smallest covered share of the figure
  double outside = 0.05;  ///< largest area of the pieces outside, as a share of the figure's area
};

/// Searches the placement of a figure at which the pieces cover it best.
///
/// Model    c(x, y, θ) is the area of the figure that the pieces cover, less the area in which pieces overlap each
///          other. The search begins with the centroids on each other, at 24 angles. From the best three angles it
///          continues by pattern search: a step along each axis in both directions, halved when none improves c.
/// Cost     one placement a call of advance(), so that a step of the room stays short; at most kMaxPlacements a search
/// Thread   room: no allocation after construction
class SilhouetteFit {
 public:
  static constexpr int kMaxPlacements = 1000;

  explicit SilhouetteFit(const SilhouettePlan& plan);

  /// Returns whether the last search of bodies that still rest has found a placement that meets the plan.
  bool is_covered() const noexcept { return is_covered_; }
  /// Best covered and outside shares of the last finished search.
  double covered() const noexcept { return covered_; }
  double outside() const noexcept { return outside_; }
  /// Continues the search by one placement, or starts one 100 steps after the last one.
  /// In      bodies  states, indexed as in the scene
  ///         absent  bit i: body i does not exist; without one of the pieces nothing is covered
  void advance(std::span<const RigidState> bodies, std::uint64_t absent = 0) noexcept;
  void reset() noexcept;

 private:
  struct Placement {
    Vec2 p = Vec2::Zero();
    double angle = 0;
    double covered_m2 = -1;
  };

  bool rest(std::span<const RigidState> bodies, std::uint64_t absent) const noexcept;
  void begin(std::span<const RigidState> bodies) noexcept;
  double covered_m2(const Placement& placement) const noexcept;
  void try_start() noexcept;
  void try_pattern() noexcept;
  void next_candidate() noexcept;
  void finish() noexcept;
  bool meets(double covered_m2) const noexcept;

  SilhouettePlan plan_;
  double size_m_;                                           ///< root of the figure's area: the unit of steps
  std::array<geometry::ConvexPolygon, kMaxPieces> pieces_;  ///< in the world, as the search began
  double pieces_area_m2_ = 0;
  double overlap_m2_ = 0;  ///< of pieces with each other
  Vec2 pieces_centre_ = Vec2::Zero();
  std::array<Placement, 3> best_{};  ///< best starts, the best one first
  Placement current_;
  double step_ = 0;      ///< of the pattern search, relative: times size_m_ and times a radian
  int placements_ = -1;  ///< tried in this search; negative: no search
  int candidate_ = 0;    ///< index into best_
  int direction_ = 0;    ///< 0..5: next direction of the pattern
  bool has_improved_ = false;
  int waited_ = 0;  ///< steps since the last search
  Placement found_;
  double covered_ = 0, outside_ = 0;
  bool is_covered_ = false;
};

}  // namespace tandem::server
