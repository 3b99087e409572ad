#include "server/docking/pose_trail.hpp"

#include "common/docking/atom_contacts.hpp"

namespace tandem::server {
namespace {

/// A molecule rests if it moves by less than kStill_angstrom (RMSD) for kRests_s. Its pose is added to the history if
/// it is farther than kElsewhere_angstrom from the current entry. Poses closer than kSame_angstrom count as equal.
constexpr double kRests_s = 0.5, kStill_angstrom = 0.1, kElsewhere_angstrom = 0.5, kSame_angstrom = 0.01;
constexpr std::size_t kMaxEntries = 100;

}  // namespace

void PoseTrail::observe(const Pose& X_AB, Step step, std::uint64_t moves) {
  if (is_moving_ && moves <= moves_) return;
  is_moving_ = false;
  moves_ = moves;
  X_AB_ = X_AB;
  if (!still_ || docking::rmsd_angstrom(*second_, *still_, X_AB) > kStill_angstrom) {
    still_ = X_AB;
    still_since_ = step;
  }
  const double rested_s = to_seconds(period_) * static_cast<double>(step.value - still_since_.value);
  if (rested_s >= kRests_s) mark_newest();
}

void PoseTrail::mark_newest() {
  if (is_elsewhere()) mark(*X_AB_);
}

void PoseTrail::move_to(const Pose& X_AB) {
  begin_move();
  mark_newest();
  mark(X_AB);
  end_at(X_AB);
}

std::optional<Pose> PoseTrail::undo() {
  begin_move();
  if (!history_.poses.empty()) mark_newest();
  if (history_.at == 0) return std::nullopt;
  return end_at(history_.poses[--history_.at]);
}

std::optional<Pose> PoseTrail::redo() {
  begin_move();
  if (history_.at + 1 >= history_.poses.size() || is_elsewhere()) return std::nullopt;
  return end_at(history_.poses[++history_.at]);
}

void PoseTrail::cancel_move() {
  history_ = history_before_;
  X_AB_ = still_ = X_AB_before_;
  is_moving_ = false;
}

bool PoseTrail::is_elsewhere() const {
  return history_.poses.empty() ||
         docking::rmsd_angstrom(*second_, history_.poses[history_.at], *X_AB_) > kElsewhere_angstrom;
}

/// Adds a pose to the history after the current entry, and deletes the entries for redo. Does nothing if the pose
/// equals the current entry.
void PoseTrail::mark(const Pose& X_AB) {
  auto& [poses, at] = history_;
  if (!poses.empty() && docking::rmsd_angstrom(*second_, poses[at], X_AB) < kSame_angstrom) return;
  poses.resize(poses.empty() ? 0 : at + 1);
  if (poses.size() == kMaxEntries) poses.erase(poses.begin());
  poses.push_back(X_AB);
  at = poses.size() - 1;
}

void PoseTrail::begin_move() {
  history_before_ = history_;
  X_AB_before_ = X_AB_;
}

Pose PoseTrail::end_at(const Pose& X_AB) {
  X_AB_ = still_ = X_AB;
  is_moving_ = true;
  return X_AB;
}

}  // namespace tandem::server
