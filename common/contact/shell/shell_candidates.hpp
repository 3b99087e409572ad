// Finds the points of a shell that are near the surface of another shape, or inside it. Visiting the whole tree over
// the shell would take much longer than a step. Each search therefore starts with the cut through the tree at which the
// previous search ended. It queries only those nodes of the cut that may have become near in the meantime. cut_node.hpp
// defines the terms.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/points/point_shell.hpp"
#include "common/contact/shell/candidate_list.hpp"
#include "common/contact/shell/cut_node.hpp"
#include "common/contact/shell/level_policy.hpp"
#include "common/contact/shell/plane_cache.hpp"
#include "common/contact/shell/shell_candidate.hpp"
#include "common/contact/shell/shell_motion.hpp"

namespace tandem::contact {

struct ContactShape;

/// Finds the points of a shell (frame P) near the surface of a field (frame F), or inside it.
///
/// Model   1. The search stores a cut through the tree: nodes that together contain each point once.
///         2. For each node of the cut, it stores a lower bound of the distances of the node's points: distance(centre)
///            − radius, or the least sampled distance for a leaf. A node is queried again only when the shell has moved
///            by this bound.
///         3. If there are too many near points for the capacity, the points of each leaf are merged into two
///            candidates: one for the points inside the other shape (pressing), with their force and moment, and one
///            for the near points outside it.
///         4. If there are still too many candidates, larger nodes are used as leaves, first those that are too far to
///            press before their next query. Only eight points of such a leaf are sampled
/// Source  the margin for motion is the skin of a neighbour list: Verlet, "Computer experiments on classical fluids I",
///         Phys. Rev. 159, 1967. The cut, the bound of the motion and the larger leaves are our own
/// Thread  any, one at a time; no allocation after construction
class ShellCandidates {
 public:
  /// In      capacity  largest number of candidates
  explicit ShellCandidates(std::uint32_t capacity);

  /// In      shell  shell of `points`; may be empty
  ///         solid  shape that owns the field
  void bind(const PointShell& shell, const ContactShape& points, const ContactShape& solid,
            std::uint32_t capacity) noexcept;

  /// Performs one step of the search: finds all points nearer than `band_m` at this pose.
  ContactWork refresh(const Pose& X_FP, double band_m) noexcept;

  /// Candidates in the order of the shell; no point of the shell is in two of them.
  std::span<const ShellCandidate> candidates() const { return list_.all(); }
  const PointShell& shell() const { return *shell_; }
  /// Returns the remaining capacity, in contacts. Each node above planes uses least_contacts_of() contacts, each other
  /// candidate one.
  std::size_t room() const { return list_.capacity() - list_.contacts(); }
  /// Returns the number of additional contacts that nodes above several planes need. The capacity includes contacts for
  /// only one plane of each node.
  std::size_t more_contacts() const { return list_.more_contacts(); }

 private:
  class Ahead;

  /// Cut and level before a trial. They are restored if the trial exceeds a capacity.
  struct KeptCut {
    LevelPolicy levels;
    std::vector<CutPart> parts;
    std::vector<CutNode> cut;
    std::size_t contacts = 0;
  };

  static constexpr std::size_t kParts = 64;

  // Functions of one step of the search, in shell_candidates.cpp.
  std::size_t cut_limit() const { return 4 * std::size_t{list_.largest_capacity()} + 4 * kParts; }
  SearchLoad load() const;
  bool has_sampled() const;
  std::uint32_t queries_to_divide() const;
  void divide(std::size_t parts) noexcept;
  void remember_gap() noexcept;
  void allow_band(double band_m) noexcept;
  void move(const Pose& X_FP) noexcept;
  void restart_motion(CutPart& part) noexcept;
  void search(double band_m) noexcept;
  void begin_coarser() noexcept;
  bool has_room_finer(double band_m) noexcept;

  // Functions that change the whole cut, in change_cut.cpp.
  void begin_cut() noexcept;
  void change_level(int level) noexcept;
  void append_as_coarse(CutNode entry, CutPart& part) noexcept;
  bool join_pairs() noexcept;
  void join_far() noexcept;
  bool keep_cut() noexcept;
  void restore_cut() noexcept;
  void keep_rest(std::size_t part) noexcept;

  // Functions of the walk (traversal of the cut), in walk.cpp.
  bool walk(double band_m) noexcept;
  bool walk_part(CutPart& part, double band_m) noexcept;
  void plan_halves_check(CutPart& part, bool is_due, bool was_worth_it) noexcept;
  bool keep(const CutNode& entry, double moved_m, double band_m) noexcept;
  bool append(const CutNode& entry) noexcept;
  std::size_t append_known(std::span<const CutNode> entries, double moved_m, double band_m) noexcept;

  // Functions that query nodes, in open_nodes.cpp.
  bool open(std::uint32_t root, double root_nearest_m, double moved_m, double band_m) noexcept;
  bool open_leaf(const CutNode& entry, double moved_m, double band_m) noexcept;
  bool open_children(std::uint32_t root, double moved_m, double band_m) noexcept;
  bool open_planes(const CutNode& above, double moved_m, double band_m) noexcept;
  bool join_above_planes(double moved_m, double band_m) noexcept;
  double nearest_m(const ShellNode& node) const;
  double nearest_m(const ShellNode& node, double distance_m) const;

  const PointShell* shell_ = nullptr;
  const DistanceField* field_ = nullptr;
  double rigid_depth_m_ = 0;
  ShellMotion motion_;
  PlaneCache planes_;
  CandidateList list_;
  LevelPolicy levels_;
  WalkState walk_;

  std::vector<CutPart> parts_;
  std::vector<CutNode> cut_;
  std::vector<CutNode> old_cut_;
  KeptCut kept_;
  std::size_t divided_up_to_ = 0;  ///< index of the part with which the next step continues dividing
  std::uint32_t walk_points_ = 0;  ///< number of points queried by the last complete walk, except by dividing
  bool has_rested_ = false;        ///< true: in the last step, pose and band were the same as in the step before
  double band_m_ = 0;              ///< band of the last step
  double least_band_m_ = 0;        ///< narrowest band so far; the bounds of points hold for this band
};

}  // namespace tandem::contact
