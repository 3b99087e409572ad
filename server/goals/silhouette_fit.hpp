// Tests whether several boards on a table form a given figure, seen from above.
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

/// A figure in the horizontal plane, and the bodies (boards) whose outlines must cover it.
struct SilhouettePlan {
  struct Piece {
    std::size_t body = 0;
    std::vector<Vec2> outline;  ///< convex, in the xy plane of the body
  };
  std::vector<Piece> pieces;
  std::vector<geometry::Triangle2> figure;  ///< the figure as triangles that do not overlap
  double figure_area_m2 = 0;
  Vec2 figure_centre = Vec2::Zero();
  double covered = 0.95;  ///< smallest fraction of the figure's area that the pieces must cover
  double outside = 0.05;  ///< largest area of the pieces outside the figure, as a fraction of the figure's area
};

/// Searches for the placement of the figure at which the pieces cover most of it.
///
/// Model    A placement of the figure is a position (x, y) and an angle θ. Its value c(x, y, θ) is the area of the
///          figure that the pieces cover, minus the area in which pieces overlap each other. The search maximises c:
///          1. The centroid of the figure is set to that of the pieces, and c is computed for 24 angles.
///          2. A pattern search starts from each of the best three placements. It tries a step along each of the three
///             axes in both directions. If none of them increases c, it halves the step.
/// Cost     one placement for each call of advance(), so that a step of the room stays short; at most kMaxPlacements
///          for a search
/// Thread   room: no allocation after construction
class SilhouetteFit {
 public:
  static constexpr int kMaxPlacements = 1000;

  explicit SilhouetteFit(const SilhouettePlan& plan);

  /// Returns whether the last search has found a placement within the tolerances of the plan. It becomes false when a
  /// piece moves.
  bool is_covered() const noexcept { return is_covered_; }
  /// Results for the best placement of the last finished search: the fraction of the figure that the pieces cover, and
  /// the area of the pieces outside the figure, divided by the figure's area.
  double covered() const noexcept { return covered_; }
  double outside() const noexcept { return outside_; }
  /// Continues the search by one placement. When a search has ended, the next one starts 100 steps of the room later.
  /// Call the function at most once per step of the room.
  /// In      bodies  states of the bodies, indexed as in the scene
  ///         absent  bit i: body i does not exist; if a piece does not exist, the figure is not covered
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
  double size_m_;                                           ///< square root of the figure's area, the unit of step_
  std::array<geometry::ConvexPolygon, kMaxPieces> pieces_;  ///< outlines in the world when the search began
  double pieces_area_m2_ = 0;
  double overlap_m2_ = 0;  ///< area in which pieces overlap each other
  Vec2 pieces_centre_ = Vec2::Zero();
  std::array<Placement, 3> best_{};  ///< best placements of the first phase, in descending order
  Placement current_;
  double step_ = 0;      ///< step of the pattern search, in units of size_m_ and in rad
  int placements_ = -1;  ///< number of placements tried in this search; negative: no search is active
  int candidate_ = 0;    ///< index into best_ of the current start
  int direction_ = 0;    ///< next direction to try: 0 to 5 for +x, −x, +y, −y, +θ, −θ
  bool has_improved_ = false;
  int waited_ = 0;  ///< steps of the room since the last search
  Placement found_;
  double covered_ = 0, outside_ = 0;
  bool is_covered_ = false;
};

}  // namespace tandem::server
