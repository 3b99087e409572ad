// Relative pose of a room's two molecules, with a history of rest poses for undo and redo.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/time.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::server {

/// Poses of the second molecule in the frame of the first [Å]: the newest one and the history.
///
/// Model   * A pose becomes a rest pose if the molecule moves by less than 0.1 Å (RMSD) for 0.5 s, and if the pose is
///         farther than 0.5 Å from the current entry of the history.
///         * A rest pose is added to the history, which has at most 100 entries. The entries for redo are deleted.
///         * The room executes a move some steps after its request. Until then the target of the move counts as the
///           newest pose, so that later requests start from the target.
/// Thread  any, one at a time
class PoseTrail {
 public:
  /// In      second  second molecule; must outlive this object
  ///         period  duration of a step of the room
  PoseTrail(const docking::Molecule& second, Duration period) : second_(&second), period_(period) {}

  /// Observes the pose of the molecules after a step. While a move is pending, the poses before its execution are
  /// ignored.
  ///
  /// In      moves  number of moves that the room had executed by the end of `step`
  void observe(const Pose& X_AB, Step step, std::uint64_t moves);
  /// Returns the newest pose; none before the first sample.
  const std::optional<Pose>& newest() const { return X_AB_; }
  /// Returns whether the last move is still pending, i.e. the room has not executed it.
  bool is_moving() const { return is_moving_; }

  /// Adds the newest pose to the history, if it is farther than 0.5 Å from the current entry.
  void mark_newest();
  /// Begins a move to a pose. Adds the newest pose and the target to the history. Requires newest().
  void move_to(const Pose& X_AB);
  /// Begins a move to the previous entry of the history. Requires newest().
  /// Out     the target; none if there is no previous entry
  std::optional<Pose> undo();
  /// Begins a move to the next entry of the history. Requires newest().
  /// Out     the target; none if there is no next entry, or if the molecule is more than 0.5 Å from the current entry
  std::optional<Pose> redo();
  /// Cancels the last move, because the room will not execute it: restores the history and the newest pose.
  void cancel_move();

 private:
  struct History {
    std::vector<Pose> poses;
    std::size_t at = 0;  ///< index of the current entry
  };

  bool is_elsewhere() const;
  void mark(const Pose& X_AB);
  void begin_move();
  Pose end_at(const Pose& X_AB);

  const docking::Molecule* second_;
  Duration period_;
  std::optional<Pose> X_AB_;
  std::optional<Pose> still_;  ///< pose from which the molecule has moved by less than 0.1 Å since still_since_
  Step still_since_{};
  History history_;
  bool is_moving_ = false;
  std::uint64_t moves_ = 0;  ///< number of executed moves at the last accepted sample

  // State before the last move, which cancel_move() restores.
  History history_before_;
  std::optional<Pose> X_AB_before_;
};

}  // namespace tandem::server
