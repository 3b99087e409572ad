// The search of one step, and the choice of its level. Each level doubles the size of the leaves whose points are
// merged into one contact. Coarser levels need fewer contacts and queries, but sample only some points.
#include <algorithm>
#include <utility>

#include "common/contact/shell/shell_candidates.hpp"

namespace tandem::contact {
namespace {

// Conditions for the trial of a finer level, as shares of the capacity. At level 0 and levels with the same leaves, at
// most kFinerBelow of the capacity may be near points. At higher levels, contacts may use at most kFinerLevelBelow. If
// near points are at most kFinestBelow and no trial has failed, the finest level is tried after kStepsToFinest steps.
// The interval between trials is at most kMaxStepsPerTry steps.
constexpr double kFinerBelow = 0.8;
constexpr double kFinerLevelBelow = 0.4;
constexpr double kFinestBelow = 0.4;
constexpr std::uint32_t kMaxStepsPerTry = 1024, kStepsToFinest = 16;
// A walk is one traversal of the cut. It may sample kQueriesPerCandidate times the capacity of points. If more than
// kMaxDenseSteps consecutive steps sample more, a coarser level begins. If few points are near, or the band is wider
// than kWideBand_m, the limit is kQueryMargin or kQueryMarginElse times higher. kQueryMargin applies if the next
// coarser level has the same leaves as level 0 where points may press.
constexpr double kQueriesPerCandidate = 1.3;
constexpr std::uint32_t kMaxDenseSteps = 4;
constexpr double kQueryMargin = 1.3, kQueryMarginElse = 2;
constexpr double kWideBand_m = 1e-3;
// A sampled node is a node of which only eight points are sampled. Dividing replaces sampled nodes by their children,
// while at most kDividedBelow of the capacity and kDividedCutBelow of the room for the cut are in use. The queries
// available for dividing are max_queries() minus kQueriesPerPoint for each point that the last walk sampled.
constexpr double kDividedBelow = 0.4, kDividedCutBelow = 0.45;
constexpr std::uint32_t kQueriesPerPoint = 2;
// Where points may press, leaves are as small as at a level that is lower by this number, but not smaller than at level
// 0.
constexpr int kFinerWherePressed = 4;

}  // namespace

ContactWork ShellCandidates::refresh(const Pose& X_FP, double band_m) noexcept {
  work_ = {};
  plane_queries_ = 0;
  if (steps_to_try_ > 0) --steps_to_try_;
  ++steps_at_level_;
  if (shell_ == nullptr || shell_->nodes.empty() || is_out_of_reach(X_FP, band_m)) return work_;
  work_.is_coarse = level_ != kFine;
  const bool is_at_rest = has_walked_ && band_m == band_m_ && is_same(X_FP, X_FP_before_);
  // At rest, one step is still searched. It measures how many queries a step needs without motion, which decides
  // whether a finer level may be tried.
  const bool has_rested = std::exchange(has_rested_, is_at_rest) || level_ == kFine;
  if (is_at_rest && has_rested && !may_be_finer() && queries_to_divide() == 0) return work_;
  work_.is_refreshed = true;
  move(X_FP);
  allow_band(band_m);
  search(band_m);
  has_walked_ = true;
  remember_gap(X_FP);
  work_.is_coarse = level_ != kFine;
  return work_;
}

void ShellCandidates::try_in(std::uint32_t steps) noexcept {
  steps_per_try_ = std::min(steps, kMaxStepsPerTry);
  steps_to_try_ = steps_per_try_;
}

// Returns whether the band is wide because of fast motion. In a wide band most near points do not press, and few bounds
// hold until the next step.
bool ShellCandidates::is_band_wide() const {
  return band_m_ > kWideBand_m;
}

// Returns whether a level has the same leaves as level 0 within the band. Where points may press, the levels up to
// kFinerWherePressed have the leaves of level 0. In a narrow band, all points may press.
bool ShellCandidates::is_as_fine(int level) const {
  return level > 0 && level <= kFinerWherePressed && band_m_ <= kMayPress_m;
}

// Walks the cut. The level changes before the walk if the measurements of the last walk require it. If a walk has no
// room, the step walks again at a coarser level.
void ShellCandidates::search(double band_m) noexcept {
  bool is_postponed = false;
  const auto switch_to_coarser = [&] {
    if (!std::exchange(is_postponed, true)) postpone_finer();
    begin_coarser();
  };
  if (dense_steps_ > kMaxDenseSteps) {
    switch_to_coarser();
  } else if (may_be_finer()) {
    if (has_room_finer(band_m)) return;
    is_postponed = true;
  }
  for (bool is_last = false; !walk(band_m) && !is_last; is_last = level_ == coarsest_level_) switch_to_coarser();
  note_density();
}

// Sets the time of the next trial of a finer level. A trial has failed if its level lasted for less than the interval
// between trials; the interval then doubles. If the search becomes coarser because dividing needed too much room, the
// interval is kept.
void ShellCandidates::postpone_finer() noexcept {
  const bool has_failed = is_try_ && steps_at_level_ < steps_per_try_;
  try_in(has_failed ? 2 * steps_per_try_ : has_divided_ ? steps_per_try_ : kStepsPerTry);
}

void ShellCandidates::begin_coarser() noexcept {
  if (has_divided_) {
    // The nodes that were divided are joined again. The number of steps until the next dividing doubles.
    steps_to_divide_ = std::min(2 * steps_to_divide_, kMaxStepsPerTry);
    const bool is_a_little_too_much = dense_steps_ > kMaxDenseSteps;
    if (is_a_little_too_much && level_ == coarsest_level_ && join_pairs()) return;
    return change_level(level_);
  }
  steps_to_divide_ = kStepsToDivide;
  change_level(coarser_level(contacts_ > capacity_ && dense_steps_ == 0));
}

// Returns the next coarser level. Above level 1, every second level is skipped. Level 0 merges a leaf's points but
// saves no query, so it is used only if there are too many contacts. Levels with the same leaves as level 0 are skipped
// too.
int ShellCandidates::coarser_level(bool has_too_many) const {
  const int next = level_ == kFine && !has_too_many ? 1 : level_ <= 0 ? level_ + 1 : level_ + 2;
  return std::min(is_as_fine(next) ? kFinerWherePressed + 1 : next, coarsest_level_);
}

// Counts consecutive steps with too many queries, which make the search coarser. A coarser search may miss contacts, so
// more queries are allowed if few points are near.
void ShellCandidates::note_density() noexcept {
  // Few points are near, in spite of many queries, where surfaces are parallel just beyond the band. In fast motion
  // most points of the wide band do not press, but the pressing ones must be found. In both cases more queries are
  // allowed.
  const bool is_near = near_count_ > capacity_ && !is_band_wide();
  const double more = is_near ? 1 : coarser_level(false) <= kFinerWherePressed ? kQueryMargin : kQueryMarginElse;
  const bool is_over = walk_points_ > more * max_queries();
  const bool is_dense = is_over && !is_coarsest();
  dense_steps_ = is_dense ? dense_steps_ + 1 : 0;
}

// Returns a lower bound of the distances of all points of a node to the field's surface.
double ShellCandidates::nearest_m(const ShellNode& node) const {
  return nearest_m(node, field_->distance_m(R_FP_ * node.centre_S.cast<double>() + p_FP_));
}

double ShellCandidates::nearest_m(const ShellNode& node, double distance_m) const {
  return distance_m - node.radius_m - 2 * field_->error_m() - kRounding_m;
}

std::uint32_t ShellCandidates::leaf_points(double nearest_m) const {
  if (level_ == kFine) return 0;
  const int doublings = nearest_m > kMayPress_m ? level_ : std::max(0, level_ - kFinerWherePressed);
  return kShellLeafPoints << static_cast<unsigned>(doublings);
}

std::uint32_t ShellCandidates::max_queries() const {
  return static_cast<std::uint32_t>(kQueriesPerCandidate * capacity_);
}

// Ends dividing once no sampled node is left. A finer level then needs few queries. If the last trial of a finer level
// had no room, the trial is repeated at once.
void ShellCandidates::end_dividing() noexcept {
  if (divide_queries_ == 0 || has_sampled()) return;
  steps_to_divide_ = kStepsToDivide;
  if (std::exchange(tries_when_divided_, false)) steps_to_try_ = 0;
}

// Returns whether the search cannot become coarser: at the coarsest level, without divided nodes that could be joined.
bool ShellCandidates::is_coarsest() const {
  return level_ == coarsest_level_ && !has_divided_;
}

// Returns the number of queries that this step may use for dividing sampled nodes. A finer level may need more queries
// than one step allows, even if its contacts fit into the capacity. Dividing spreads these queries over several steps.
std::uint32_t ShellCandidates::queries_to_divide() const {
  if (level_ == kFine || !has_walked_ || steps_at_level_ < steps_to_divide_) return 0;
  const auto is_below = [](auto used, double share, auto limit) {
    return static_cast<double>(used) <= share * static_cast<double>(limit);
  };
  const bool has_room = is_below(contacts_, kDividedBelow, capacity_) &&
                        is_below(cut_.size(), kDividedCutBelow, cut_limit()) && has_sampled();
  return has_room ? max_queries() - std::min(max_queries(), kQueriesPerPoint * walk_points_) : 0;
}

bool ShellCandidates::may_be_finer() const {
  // No finer level is tried while nodes are being divided, because the trial would query all remaining sampled nodes in
  // one step.
  if (level_ == kFine || queries_to_divide() > 0) return false;
  const auto is_below = [&](std::size_t used, double share) { return static_cast<double>(used) <= share * capacity_; };
  const bool has_failed = steps_per_try_ > kStepsPerTry;
  const bool is_little_near = is_below(near_count_, kFinestBelow);
  if (steps_to_try_ > (is_little_near && !has_failed ? kStepsPerTry - kStepsToFinest : 0)) return false;
  if (is_little_near) return true;
  if (level_ == 0 || is_as_fine(level_)) return is_below(near_count_, kFinerBelow) && walk_points_ <= max_queries();
  return is_below(contacts_, kFinerLevelBelow) && (near_count_ <= capacity_ || 2 * walk_points_ <= max_queries());
}

// Tries a finer level. Returns false if the walk at that level had no room. The previous result is then restored. If
// the previous result was too large to be stored, a coarser level begins instead.
bool ShellCandidates::has_room_finer(double band_m) noexcept {
  const bool is_kept = keep_found();
  const int next = is_as_fine(level_) ? kFine : is_as_fine(level_ - 1) ? 0 : level_ - 1;
  change_level(static_cast<double>(near_count_) <= kFinestBelow * capacity_ ? kFine : next);
  is_try_ = true;
  steps_to_try_ = steps_per_try_;
  if (walk(band_m)) return true;
  try_in(2 * steps_per_try_);
  if (is_kept) {
    restore_found();
    tries_when_divided_ = has_sampled();
  } else {
    begin_coarser();
  }
  return false;
}

}  // namespace tandem::contact
