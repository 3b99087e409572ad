// Which points of a shell may touch another shape in the next few steps. A walk of the tree over the shell costs much
// more than a step may; so it gathers the points of a wider neighbourhood, and is repeated when the shapes have moved
// so far that others may have come near.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/contact/distance_field.hpp"
#include "common/contact/point_shell.hpp"

namespace tandem::contact {

struct ContactShape;

/// What a search had to do.
struct ContactWork {
  std::uint32_t nodes = 0;
  std::uint32_t points = 0;
  bool is_coarse = false;     ///< the budget was reached: points stand for several
  bool is_refreshed = false;  ///< some of the tree was walked

  ContactWork& operator+=(const ContactWork& other);
};

/// A point of the shell, or the mean of several, or a node above planes of the field.
struct ShellCandidate {
  Eigen::Vector3f p_P = Eigen::Vector3f::Zero();
  float area_m2 = 0;
  float distance_m = 0;  ///< at the last walk; of a node, at least
  std::uint32_t first = 0;
  std::uint32_t count = 0;  ///< it stands for points first .. first + count − 1
  std::uint32_t node = 0;   ///< it is this one, if it has planes
  PlaneSet planes = 0;      ///< below the node; none for points
};

/// A part of the shell with its candidates: parts are walked one by one, when they have moved too far.
struct ShellPart {
  std::uint32_t node = 0;   ///< the root of its tree
  std::uint32_t begin = 0;  ///< its candidates
  std::uint32_t count = 0;
  std::size_t contacts = 0;  ///< as many as must find room
  double motion_m = 0;       ///< none of its points is nearer to the field than at its last walk, less this

  /// Of the points alone at the last look, and where ShellCandidates::drift_m_ was then.
  double looked_motion_m = 0;
  double looked_drift_m = 0;
  bool has_old_look = false;  ///< motion_m is of an earlier pose than the last refresh

  // Of the last walk:
  bool is_walked = false;
  std::uint32_t steps_since = 0;
  double reach_m = 0;         ///< all points that were nearer than this are candidates
  double plane_motion_m = 0;  ///< until which nodes are above their planes
  Vec3 centre_F = Vec3::Zero();
  Vec3 solid_P = Vec3::Zero();
  Quat q_FP = Quat::Identity();
};

/// The points of a shell (frame P) near the surface of a field (frame F), or inside it: a Verlet list in parts.
///
/// Model   of a node, nothing is near when distance(centre) − radius exceeds the reach; the list of a part lacks no
///         point until part and field have moved by (reach − band) against each other
/// Source  Verlet, "Computer experiments on classical fluids I", Phys. Rev. 159, 1967, for the list; the bound of the
///         motion and the parts are ours
/// Thread  one at a time; after construction no allocation
class ShellCandidates {
 public:
  /// In      capacity  most candidates
  explicit ShellCandidates(std::uint32_t capacity);
  ShellCandidates(ShellCandidates&& other) noexcept;
  ~ShellCandidates();

  /// In      shell  of `points`; may be empty
  ///         solid  whose field it is
  void bind(const PointShell& shell, const ContactShape& points, const ContactShape& solid,
            std::uint32_t capacity) noexcept;

  /// Makes the list hold at this pose: walks the tree where it must.
  ContactWork refresh(const Pose& X_FP, double band_m) noexcept;

  /// In the order of the shell; no point of the shell is in two of them.
  std::span<const ShellCandidate> candidates(const ShellPart& part) const {
    return std::span(candidates_).subspan(part.begin, part.count);
  }
  std::span<const ShellPart> parts() const { return parts_; }
  const PointShell& shell() const { return *shell_; }
  /// For more contacts than contacts_of_node() for each node, and one for each other candidate.
  std::size_t room() const { return capacity_ - contacts_; }

 private:
  /// A node of the cut through the tree, and what refining it gains.
  struct Cut {
    float gain_m = 0;
    std::uint32_t node = 0;
  };

  static constexpr std::size_t kParts = 64;  ///< their balls are small, so that they move little when the shape turns

  bool has_room(std::size_t contacts) const { return contacts_ + contacts <= capacity_; }
  bool has_flat_parts() const { return !shell_->flat_nodes.empty(); }
  void divide(std::size_t parts) noexcept;
  bool is_out_of_reach(const Pose& X_FP, double band_m) noexcept;
  void add_drift(const Pose& X_FP) noexcept;
  void look_at(ShellPart& part, const Pose& X_FP) const noexcept;
  static bool is_due(const ShellPart& part, double band_m);
  bool has_expired(ShellPart& part, const Pose& X_FP, double band_m) const noexcept;
  void remember_gap(const Pose& X_FP, double band_m) noexcept;
  bool walk_expired(const Pose& X_FP, double band_m) noexcept;
  bool walk_all(const Pose& X_FP, double reach_m) noexcept;
  void walk_coarse(const Pose& X_FP, double reach_m) noexcept;
  void walk_whole(const Pose& X_FP, double reach_m) noexcept;
  void begin_walk(ShellPart& part, const Pose& X_FP, double slack_m) noexcept;
  void end_walk(ShellPart& part) noexcept;
  double slack_of(const ShellPart& part) const;

  bool is_reached(double nearest_m, double reach_m) noexcept;
  bool gather_all(std::uint32_t root, double reach_m) noexcept;
  PlaneSet planes_below(const ShellNode& node) const noexcept;
  bool gather_planes(std::uint32_t index, PlaneSet planes, double reach_m) noexcept;
  bool gather_leaf(const ShellNode& node, double reach_m, std::size_t room) noexcept;
  void merge_flat(std::size_t begin) noexcept;
  void gather_coarse(double reach_m) noexcept;
  std::uint32_t find_deepest() noexcept;
  bool has_deepest(const ShellNode& node) const;
  void gather_leaf_coarse(const ShellNode& node, double reach_m, std::size_t used) noexcept;
  void gather_halves(const ShellNode& leaf, double reach_m) noexcept;
  void gather_mean(const ShellNode& node) noexcept;
  void open_node(std::uint32_t index, double reach_m) noexcept;
  bool open_children(std::uint32_t parent, double reach_m, std::size_t room) noexcept;
  double distance_at(const Eigen::Vector3f& p_P) const;

  const PointShell* shell_ = nullptr;
  const DistanceField* field_ = nullptr;
  Vec3 points_centre_P_ = Vec3::Zero();  ///< of a ball around the shell's points
  double points_radius_m_ = 0;
  Vec3 solid_centre_F_ = Vec3::Zero();  ///< of one around what `field_` is the distance to
  double solid_radius_m_ = 0;
  std::uint32_t capacity_ = 0;

  std::vector<ShellPart> parts_;
  std::vector<ShellCandidate> candidates_;
  std::vector<ShellCandidate> old_candidates_;
  std::size_t contacts_ = 0;  ///< that must find room
  std::vector<Cut> cut_;
  bool is_coarse_ = false;
  double slack_limit_m_ = 0;
  double gap_m_ = 0;  ///< motion until which there is nothing to do
  Pose X_FP_gap_;
  double drift_m_ = 0;  ///< sum over refreshes: no part of the shell moved farther
  double lever_m_ = 0;  ///< of the parts about points_centre_P_
  Pose X_FP_before_;

  // Of the walk that goes on.
  Eigen::Matrix3d R_FP_ = Eigen::Matrix3d::Identity();
  Vec3 p_FP_ = Vec3::Zero();
  Vec3 solid_P_ = Vec3::Zero();
  double reach_m_ = 0;
  double plane_motion_m_ = 0;
  std::size_t contacts_before_ = 0;  ///< the part that is walked
  bool has_planes_ = false;          ///< the part that is walked
  std::uint32_t deepest_point_ = 0;  ///< of a coarse walk
  std::uint32_t coarse_walks_ = 0;   ///< since the last bind()
  std::size_t fine_count_ = 0;       ///< at least how many candidates a coarse walk would have had as points
  ContactWork work_;
};

}  // namespace tandem::contact
