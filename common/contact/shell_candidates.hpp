// Which points of a shell may touch another shape. A walk of the tree over the shell costs much more than a step may; so
// what was found is kept, each with how far it still is, and asked again when the shapes have moved that far.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/contact/distance_field.hpp"
#include "common/contact/point_shell.hpp"

namespace tandem {

/// What a search had to do.
struct ContactWork {
  std::uint32_t nodes = 0;
  std::uint32_t points = 0;
  bool is_coarse = false;     ///< the budget was reached: points stand for several
  bool is_refreshed = false;  ///< some of the tree was walked

  ContactWork& operator+=(const ContactWork& other);
};

/// A ball in the frame of a shape.
struct BoundingBall {
  Vec3 centre_S = Vec3::Zero();
  double radius_m = 0;
};

/// What a list holds: a point of the shell, a flat leaf of it, the mean of many points, or a node not looked into yet.
struct ShellCandidate {
  enum class Kind : std::uint8_t { kPoints, kFlatLeaf, kUnopened };

  Eigen::Vector3f p_P = Eigen::Vector3f::Zero();
  float area_m2 = 0;
  float nearest_m = 0;  ///< its points are farther than this, less what the part has travelled
  float whole_m = 0;    ///< of a flat leaf: it may be taken as one point until the part has travelled this
  std::uint32_t first = 0;
  std::uint32_t count = 0;  ///< it stands for points first .. first + count − 1
  std::uint32_t node = 0;   ///< of the shell; without meaning for kPoints
  Kind kind = Kind::kPoints;
};

/// A part of the shell with its candidates: a ball small enough to move little when the shape turns.
struct ShellPart {
  std::uint32_t node = 0;   ///< the root of its tree
  std::uint32_t begin = 0;  ///< its candidates
  std::uint32_t count = 0;
  bool is_walked = false;
  double travel_m = 0;  ///< a bound of what distances of its points have changed since it was walked, step by step
  double due_m = 0;     ///< no candidate has a smaller nearest_m

  // None of its candidates must be replaced before travel_m plus the band comes to `open_m`, or travel_m to `check_m`.
  double open_m = 0;
  double check_m = 0;
};

/// The points of a shell (frame P) near the surface of a field (frame F), or inside it.
///
/// Model   a cut through the tree over the shell. Each node and point of it was asked for its distance once, and cannot
///         be near before it has travelled that far; only then it is asked again, a node by way of its children. So a
///         step costs what has come near in that step; shapes that rest cost nothing here. A leaf whose points are at
///         nearly one distance stays whole: flat contact is resolved by leaves, an eighth of the points. Nearly: to
///         half of the gap, for what does not touch yet; to a tenth of the depth and 10 µm for what is inside
/// Source  Verlet, "Computer experiments on classical fluids I", Phys. Rev. 159, 1967, for lists that hold while nothing
///         has moved farther than a margin; the margin of each entry, and its tree, are ours
/// Thread  one at a time; after construction no allocation
class ShellCandidates {
 public:
  /// In      capacity  most contacts that bind() may ask for
  explicit ShellCandidates(std::uint32_t capacity);

  /// In      shell     may be empty
  ///         points    a ball around the shell's points
  ///         solid     a ball around what `field` is the distance to
  ///         capacity  most candidates that may be near at once; with more, points are merged
  void bind(const PointShell* shell, const BoundingBall& points, const DistanceField* field, const BoundingBall& solid,
            std::uint32_t capacity) noexcept;
  std::uint32_t capacity() const { return capacity_; }

  /// Makes the list hold at this pose: none of the candidates whose nearest_m is within reach_m() is unopened.
  ContactWork refresh(const Pose& X_FP, double band_m) noexcept;
  /// For a list that has more candidates in the band than capacity(): drops what is not up to date; then leaves that do
  /// not touch become one candidate each; then points are merged where contact is shallowest. It stays like that until
  /// there is less.
  ContactWork shorten(double band_m) noexcept;

  /// A candidate with a larger nearest_m is out of the band.
  double reach_m(const ShellPart& part, double band_m) const { return band_m + margin_m_ + part.travel_m; }
  /// Whether points at distances from `nearest_m` to `farthest_m` may be taken as one.
  bool is_flat(double nearest_m, double farthest_m) const;
  /// Tells how many points there were in the band, those that were merged included.
  void count_points(std::size_t points) { points_in_band_ = points; }
  /// Notes what was found at the pose of the last refresh(): a distance from the field's sample().
  void note(const ShellPart& part, ShellCandidate& point, double distance_m) const {
    point.nearest_m = static_cast<float>(std::min(distance_m, field_->band_m()) + part.travel_m);
  }

  /// In the order of the shell; no point of the shell is in two of them.
  std::span<ShellCandidate> candidates(const ShellPart& part) {
    return std::span(candidates_).subspan(part.begin, part.count);
  }
  std::span<ShellPart> parts() { return parts_; }
  const PointShell* shell() const { return shell_; }

 private:
  /// A node of the cut through the tree, and what refining it gains.
  struct Cut {
    float gain_m = 0;
    std::uint32_t node = 0;
  };

  /// What the points of a leaf were found to be at.
  struct Leaf {
    std::array<double, kShellLeafPoints> distances_m;
    double nearest_m;
    double farthest_m;
  };

  void divide(std::size_t parts) noexcept;
  bool is_out_of_reach(const Pose& X_FP, double band_m) const noexcept;
  double travel(const Pose& X_FP) noexcept;
  void remember_gap() noexcept;

  bool update_all(double band_m) noexcept;
  void renew_one(double band_m) noexcept;
  bool renew_all(double band_m) noexcept;
  bool merge_outside(double band_m) noexcept;
  bool update(ShellPart& part, double band_m) noexcept;
  bool rebuild(ShellPart& part, double band_m) noexcept;
  void begin_walk(ShellPart& part) noexcept;
  void compact() noexcept;
  void replace(ShellPart& part, const ShellCandidate& old, double band_m) noexcept;
  void open(ShellPart& part, std::uint32_t root, double open_m) noexcept;
  void open_leaf(ShellPart& part, std::uint32_t index) noexcept;
  void put(ShellPart& part, const ShellCandidate& candidate) noexcept;

  void coarsen(double band_m) noexcept;
  void walk_coarse(double band_m) noexcept;
  bool is_reached(double nearest_m, double reach_m) noexcept;
  void gather_coarse(double reach_m) noexcept;
  std::uint32_t find_deepest() noexcept;
  bool gather_leaf(const ShellNode& node, const Leaf& leaf, double reach_m, std::size_t room) noexcept;
  void gather_leaf_coarse(const ShellNode& node, double reach_m, std::size_t used) noexcept;
  void gather_halves(const ShellNode& node, const Leaf& leaf, double reach_m) noexcept;
  void gather_mean(const ShellNode& node) noexcept;
  void open_node(std::uint32_t index, double reach_m) noexcept;
  bool open_children(std::uint32_t parent, double reach_m, std::size_t room) noexcept;
  Leaf ask(const ShellNode& leaf) noexcept;
  double distance_at(const Eigen::Vector3f& p_P) const;

  const PointShell* shell_ = nullptr;
  const DistanceField* field_ = nullptr;
  BoundingBall points_;
  BoundingBall solid_;
  std::uint32_t capacity_ = 0;
  double margin_m_ = 0;  ///< for what the field errs and rounding

  std::vector<ShellPart> parts_;
  std::vector<ShellCandidate> candidates_;  ///< of all parts, and what some of them have left behind
  std::vector<Cut> cut_;
  bool is_coarse_ = false;         ///< one part, of a coarse walk
  bool merges_outside_ = false;    ///< leaves that do not touch
  std::size_t points_in_band_ = 0;
  double gap_m_ = 0;  ///< nothing is nearer at the last pose
  Pose X_FP_;         ///< the last pose
  Eigen::Matrix3d R_FP_ = Eigen::Matrix3d::Identity();

  // Of the refresh that goes on.
  double step_m_ = 0;         ///< the largest motion of a part since the last pose
  bool is_full_ = false;
  double reach_m_ = 0;               ///< of a coarse list
  std::uint32_t deepest_point_ = 0;  ///< of a coarse walk
  std::size_t fine_count_ = 0;       ///< at least how many candidates in the band there would be if they fitted
  ContactWork work_;
};

}  // namespace tandem
