// Finds the points of a shell that are near the surface of another shape, or inside it, at a pose. A traversal of the
// whole tree over the shell costs much more time than a step has. The search therefore stores the cut through the tree
// at which the last step ended. It queries only those nodes that may have come near since.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/points/point_shell.hpp"
#include "common/contact/shell/cut_node.hpp"
#include "common/contact/shell/shell_candidate.hpp"

namespace tandem::contact {

struct ContactShape;

/// Work that a search did.
struct ContactWork {
  std::uint32_t nodes = 0;
  std::uint32_t points = 0;
  bool is_coarse = false;     ///< points were merged, because the budget does not suffice for single points
  bool is_refreshed = false;  ///< the field was queried; false: the result of the last step is still valid

  std::uint32_t queries() const { return nodes + points; }
  ContactWork& operator+=(const ContactWork& other);
};

/// Finds the points of a shell (frame P) near the surface of a field (frame F), or inside it.
///
/// Model   The search stores a cut through the tree: nodes that together contain each point once. Each of its nodes has
///         a lower bound of the distances of its points: distance(centre) − radius, or the sampled distances of a
///         leaf's points. A node is queried again only when the shell and the field have moved against each other by
///         its bound. If more points are near than the capacity allows, the pressing points of a leaf are merged into
///         one candidate. It has their force and moment. The other near points are merged into a second candidate. If
///         there still are too many, larger nodes become leaves, of which only eight points are sampled. Nodes that
///         cannot press become larger first, then those that may
/// Source  after Verlet, "Computer experiments on classical fluids I", Phys. Rev. 159, 1967, for the margin for motion
///         (the skin of a neighbour list). The cut, the bound of the motion and the larger leaves are ours
/// Thread  one at a time; no allocation after construction
class ShellCandidates {
 public:
  /// In      capacity  largest number of candidates
  explicit ShellCandidates(std::uint32_t capacity);
  ShellCandidates(ShellCandidates&& other) noexcept;
  ~ShellCandidates();

  /// In      shell  shell of `points`; may be empty
  ///         solid  shape that owns the field
  void bind(const PointShell& shell, const ContactShape& points, const ContactShape& solid,
            std::uint32_t capacity) noexcept;

  /// Finds all points nearer than `band_m` at this pose.
  ContactWork refresh(const Pose& X_FP, double band_m) noexcept;

  /// Candidates in the order of the shell; no point of the shell is in two of them.
  std::span<const ShellCandidate> candidates() const { return candidates_; }
  const PointShell& shell() const { return *shell_; }
  /// Returns the number of further contacts for which there is room. Of the capacity, each node above planes takes
  /// least_contacts_of(), and each other candidate takes one.
  std::size_t room() const { return capacity_ - contacts_; }
  /// Returns the number of additional contacts needed to represent every plane below the nodes.
  std::size_t more_contacts() const { return more_contacts_; }

 private:
  struct Part;
  struct Found;
  class Ahead;

  static constexpr std::size_t kParts = 64, kAnswers = 4096;

  std::uint32_t max_queries() const;
  std::uint32_t queries_to_divide() const;
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
  void postpone_finer() noexcept;
  void begin_coarser() noexcept;
  bool has_room_finer(double band_m) noexcept;
  static CutNode unknown(std::uint32_t node);
  void set_level(int level) noexcept;
  void change_level(int level) noexcept;
  void append_as_coarse(CutNode entry, Part& part) noexcept;
  void keep_rest(std::size_t part) noexcept;
  void join_far() noexcept;
  bool join_pairs() noexcept;
  bool keep_found() noexcept;
  void restore_found() noexcept;

  bool open(std::uint32_t root, double root_nearest_m, double moved_m, double band_m) noexcept;
  bool open_leaf(const CutNode& entry, double moved_m, double band_m) noexcept;
  bool open_children(std::uint32_t root, double moved_m, double band_m) noexcept;
  bool keep(const CutNode& entry, double moved_m, double band_m) noexcept;
  bool append(const CutNode& entry) noexcept;
  std::size_t append_known(std::span<const CutNode> entries, double moved_m, double band_m) noexcept;
  double nearest_m(const ShellNode& node) const;
  double nearest_m(const ShellNode& node, double distance_m) const;
  /// Returns the largest number of points for which a node at this distance is treated as a leaf.
  std::uint32_t leaf_points(double nearest_m) const;
  CutNode planes_below(std::uint32_t index, double moved_m) noexcept;
  bool join_above_planes(double moved_m, double band_m) noexcept;
  std::size_t more_contacts_of(std::uint32_t index, PlaneSet planes) const;
  bool open_planes(const CutNode& above, double moved_m, double band_m) noexcept;
  bool add_planes(std::uint32_t index, PlaneSet planes) noexcept;

  const PointShell* shell_ = nullptr;
  const DistanceField* field_ = nullptr;
  Vec3 points_centre_P_ = Vec3::Zero();  ///< centre of a ball around the shell's points
  double points_radius_m_ = 0;
  Vec3 solid_centre_F_ = Vec3::Zero();  ///< centre of a ball around the solid of `field_`
  double solid_radius_m_ = 0;
  double rigid_depth_m_ = 0;
  std::uint32_t largest_capacity_ = 0;
  std::uint32_t capacity_ = 0;

  std::vector<Part> parts_;
  std::vector<CutNode> cut_;
  std::vector<CutNode> old_cut_;
  std::vector<ShellCandidate> candidates_;
  std::vector<CutNode> answers_;    ///< cached results of plane queries; each node maps to one slot
  std::size_t contacts_ = 0;        ///< contacts that the candidates need; at most capacity_
  std::size_t more_contacts_ = 0;   ///< result of more_contacts()
  std::size_t near_count_ = 0;      ///< estimated number of near points; a node above planes counts as its contacts
  int level_ = kFine;               ///< kFine: only equally deep points are merged; 0 and more: see leaf_points()
  int coarsest_level_ = 0;          ///< lowest level at which each part is a single leaf, until dividing begins
  std::uint32_t steps_to_try_ = 0;  ///< steps until a finer level is tried
  std::uint32_t steps_per_try_ = 0, steps_at_level_ = 0;
  bool is_try_ = false;                             ///< the current level began as the trial of a finer level
  std::size_t divided_up_to_ = 0;                   ///< index of the part where the next step continues to divide nodes
  std::uint32_t steps_to_divide_ = kStepsToDivide;  ///< steps at a level until dividing begins
  std::uint32_t steps_of_join_ = 0;                 ///< value of steps_at_level_ when join_far() last ran
  bool tries_when_divided_ = false;                 ///< a finer level is tried once all sampled nodes are divided
  bool has_rested_ = false;                         ///< the last step had the same pose as the one before
  std::unique_ptr<Found> before_;                   ///< result of the previous level during a trial
  std::uint32_t walk_points_ = 0;                   ///< points that the last walk sampled, except those due to dividing
  std::uint32_t dense_steps_ = 0;                   ///< consecutive steps with too many queries
  double gap_m_ = 0;  ///< no point is near while the motion since X_FP_gap_ plus the band is below this; < 0: unknown
  Pose X_FP_gap_;
  double band_m_ = 0;        ///< band of the last step
  double least_band_m_ = 0;  ///< narrowest band of all steps
  Pose X_FP_before_;
  bool has_walked_ = false;

  // State of the current walk.
  Eigen::Matrix3d R_FP_ = Eigen::Matrix3d::Identity();
  Vec3 p_FP_ = Vec3::Zero();
  std::uint32_t root_ = 0;            ///< root of the part that is walked
  float first_at_m_ = 0;              ///< least motion plus band at which an entry of the walked part is queried again
  std::size_t plane_queries_ = 0;     ///< number of the field's table entries read by new plane queries in this step
  bool is_question_open_ = false;     ///< some node of the walked part was not queried for planes, due to the limit
  std::uint32_t query_limit_ = 0;     ///< limit of the walk's queries
  std::uint32_t divide_queries_ = 0;  ///< remaining queries for dividing sampled nodes
  std::uint32_t divide_points_ = 0;   ///< number of points sampled by dividing in this walk
  bool divides_part_ = false;         ///< sampled nodes of the walked part are divided
  bool has_divided_ = false;          ///< nodes were divided at this level
  bool has_sampled_ = false;          ///< the walked part has a sampled node
  bool may_check_halves_ = false;     ///< this walk may still check a part for halves to join above planes
  ContactWork work_;

  static constexpr int kFine = -1;
  static constexpr double kMayPress_m = 2e-4;                            ///< nodes nearer than this may press
  static constexpr std::uint32_t kStepsPerTry = 64, kStepsToDivide = 4;  ///< initial values of the intervals
};

}  // namespace tandem::contact
