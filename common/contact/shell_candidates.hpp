// Which points of a shell are near the surface of another shape, or inside it, at this pose. A walk of the tree over the
// shell costs much more than a step may; so the cut through the tree that the last step ended at is kept, and only what
// may have come near since is asked again.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/contact/distance_field.hpp"
#include "common/contact/point_shell.hpp"
#include "common/contact/shell/leaf_samples.hpp"

namespace tandem::contact {

struct ContactShape;

/// What a search had to do.
struct ContactWork {
  std::uint32_t nodes = 0;
  std::uint32_t points = 0;
  bool is_coarse = false;     ///< the budget was reached: points stand for several
  bool is_refreshed = false;  ///< something was asked of the field

  std::uint32_t looks() const { return nodes + points; }
  ContactWork& operator+=(const ContactWork& other);
};

/// The points of a shell (frame P) near the surface of a field (frame F), or inside it.
///
/// Model   a cut through the tree: of each of its nodes is known how far away its points are at least, and until part of
///         the shell and field have moved by that against each other, it is not asked. Of a node, no point is nearer than
///         distance(centre) − radius; a leaf has its points asked. Where more are near than there is room for, the points
///         of a leaf that press are one candidate, with their force and the moment of it, and those that do not press
///         yet another; and where that is too much, larger nodes are leaves, with as many of their points: first those that
///         cannot press, then what may
/// Source  after Verlet, "Computer experiments on classical fluids I", Phys. Rev. 159, 1967: motion that is allowed for;
///         the cut, the bound of the motion and the larger leaves are ours
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

  /// Finds what is nearer than `band_m` at this pose.
  ContactWork refresh(const Pose& X_FP, double band_m) noexcept;

  /// In the order of the shell; no point of the shell is in two of them.
  std::span<const ShellCandidate> candidates() const { return candidates_; }
  const PointShell& shell() const { return *shell_; }
  /// For more contacts than least_contacts_of() each node, and one for each other candidate.
  std::size_t room() const { return capacity_ - contacts_; }
  /// So many more the nodes should have, for all planes below them.
  std::size_t more_contacts() const { return more_contacts_; }

 private:
  struct CutNode;
  struct Part;
  struct Found;
  class Ahead;

  static constexpr std::size_t kParts = 64, kAnswers = 4096;

  std::uint32_t most_looks() const;
  std::uint32_t looks_to_divide() const;
  bool is_coarsest() const;
  bool has_sampled() const;
  void end_dividing() noexcept;
  std::size_t cut_limit() const { return 4 * std::size_t{largest_capacity_} + 4 * kParts; }
  void divide(std::size_t parts) noexcept;
  void begin_cut() noexcept;
  bool is_out_of_reach(const Pose& X_FP, double band_m) noexcept;
  void remember_gap(const Pose& X_FP) noexcept;
  void allow_band(double band_m) noexcept;
  void move(const Pose& X_FP) noexcept;
  void start_again_from_0(Part& part) noexcept;
  bool walk(double band_m) noexcept;
  bool walk_part(Part& part, double band_m) noexcept;
  void note_density() noexcept;
  bool may_be_finer() const;
  bool is_as_fine(int level) const;
  int coarser_level(bool has_too_many) const;
  bool is_band_wide() const;
  void try_in(std::uint32_t steps) noexcept;
  void search(double band_m) noexcept;
  void put_off_finer() noexcept;
  void begin_coarser() noexcept;
  bool has_room_finer(double band_m) noexcept;
  static CutNode unknown(std::uint32_t node);
  void set_level(int level) noexcept;
  void change_level(int level) noexcept;
  void put_as_coarse(CutNode entry, Part& part) noexcept;
  void keep_rest(std::size_t part) noexcept;
  void join_far() noexcept;
  bool join_pairs() noexcept;
  bool keep_found() noexcept;
  void take_back_found() noexcept;

  bool open(std::uint32_t root, double root_nearest_m, double gone_m, double band_m) noexcept;
  bool open_leaf(const CutNode& entry, double gone_m, double band_m) noexcept;
  bool open_children(std::uint32_t root, double gone_m, double band_m) noexcept;
  bool keep(const CutNode& entry, double gone_m, double band_m) noexcept;
  bool put(const CutNode& entry) noexcept;
  std::size_t put_known(std::span<const CutNode> entries, double gone_m, double band_m) noexcept;
  double nearest_m(const ShellNode& node) const;
  double nearest_m(const ShellNode& node, double distance_m) const;
  /// So few points make a node so far away a leaf.
  std::uint32_t leaf_points(double nearest_m) const;
  CutNode planes_below(std::uint32_t index, double gone_m) noexcept;
  bool join_above_planes(double gone_m, double band_m) noexcept;
  std::size_t more_contacts_of(std::uint32_t index, PlaneSet planes) const;
  bool open_planes(const CutNode& above, double gone_m, double band_m) noexcept;
  bool add_planes(std::uint32_t index, PlaneSet planes) noexcept;

  const PointShell* shell_ = nullptr;
  const DistanceField* field_ = nullptr;
  Vec3 points_centre_P_ = Vec3::Zero();  ///< of a ball around the shell's points
  double points_radius_m_ = 0;
  Vec3 solid_centre_F_ = Vec3::Zero();  ///< of one around what `field_` is the distance to
  double solid_radius_m_ = 0;
  double rigid_depth_m_ = 0;
  std::uint32_t largest_capacity_ = 0;
  std::uint32_t capacity_ = 0;

  std::vector<Part> parts_;
  std::vector<CutNode> cut_;
  std::vector<CutNode> old_cut_;
  std::vector<ShellCandidate> candidates_;
  std::vector<CutNode> answers_;    ///< of nodes that were asked for planes; each has one place
  std::size_t contacts_ = 0;        ///< that must find room
  std::size_t more_contacts_ = 0;   ///< that should
  std::size_t near_count_ = 0;      ///< as many candidates there would be if each were a point
  int level_ = kFine;               ///< kFine, or as leaf_points() says nodes are leaves, at most two candidates each
  int coarsest_level_ = 0;          ///< where each part is a leaf until it is divided
  std::uint32_t steps_to_try_ = 0;  ///< a finer level
  std::uint32_t steps_per_try_ = 0, steps_at_level_ = 0;
  bool is_try_ = false;                             ///< this level was tried
  std::size_t divided_up_to_ = 0;                   ///< the part where the next step goes on to divide nodes
  std::uint32_t steps_to_divide_ = kStepsToDivide;  ///< at a level, until that begins
  std::uint32_t steps_of_join_ = 0;                 ///< at this level, when what is far was joined in a full cut
  bool tries_when_divided_ = false;                 ///< a finer level had no room before
  bool has_rested_ = false;                         ///< the last step was like the one before
  std::unique_ptr<Found> before_;                   ///< what the level before had, while it is
  std::uint32_t walk_points_ = 0;                   ///< that the last walk asked
  std::uint32_t dense_steps_ = 0;                   ///< that asked too many
  double gap_m_ = 0;                                ///< motion until which there is nothing to do
  Pose X_FP_gap_;
  double band_m_ = 0;        ///< of the last step, as its pose
  double least_band_m_ = 0;  ///< of all steps
  Pose X_FP_before_;
  bool has_walked_ = false;

  // Of the step that goes on.
  Eigen::Matrix3d R_FP_ = Eigen::Matrix3d::Identity();
  Vec3 p_FP_ = Vec3::Zero();
  std::uint32_t root_ = 0;           ///< of the part that is walked
  float first_at_m_ = 0;             ///< of the nodes that it keeps, when the first is asked again
  std::size_t plane_looks_ = 0;      ///< of the field, for nodes that were newly asked for planes
  bool is_question_open_ = false;    ///< in the part that is walked: some node was not asked
  std::uint32_t looks_end_ = 0;      ///< of the walk
  std::uint32_t divide_looks_ = 0;   ///< left to divide nodes of which eight points stand for all
  std::uint32_t divide_points_ = 0;  ///< that were asked for that
  bool divides_part_ = false;        ///< the one that is walked
  bool has_divided_ = false;         ///< at this level
  bool has_sampled_ = false;         ///< some node that the part keeps
  bool may_look_over_ = false;       ///< a part, for halves that are one above planes
  ContactWork work_;

  static constexpr int kFine = -1;
  static constexpr double kMayPress_m = 2e-4;                            ///< nearer than this
  static constexpr std::uint32_t kStepsPerTry = 64, kStepsToDivide = 4;  ///< at first
};

}  // namespace tandem::contact
