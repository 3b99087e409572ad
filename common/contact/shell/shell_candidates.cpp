// One step of the search: adds the motion of the step, chooses the level, and walks the cut. cut_node.hpp defines the
// terms.
#include "common/contact/shell/shell_candidates.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/contact/contact_shape.hpp"

namespace tandem::contact {

ShellCandidates::ShellCandidates(std::uint32_t capacity) : list_(capacity) {
  for (auto* parts : {&parts_, &kept_.parts}) parts->reserve(kParts + 1);
  // Before a trial of a finer level, the current cut is stored. Most trials start while the cut uses at most half of
  // its limit.
  kept_.cut.reserve(cut_limit() / 2);
  cut_.reserve(cut_limit());
  old_cut_.reserve(cut_limit());
}

void ShellCandidates::bind(const PointShell& shell, const ContactShape& points, const ContactShape& solid,
                           std::uint32_t capacity) noexcept {
  shell_ = &shell;
  field_ = solid.field.get();
  rigid_depth_m_ = std::min(points.rigid_depth_m, solid.rigid_depth_m);
  motion_.bind(points, solid);
  planes_.bind(shell, *field_);
  list_.bind(shell, capacity);
  least_band_m_ = std::numeric_limits<double>::infinity();
  has_rested_ = false;
  divided_up_to_ = 0;
  // At the coarsest level, each part that is not divided gives up to two candidates. A quarter of the capacity
  // therefore suffices as the number of parts.
  divide(std::clamp<std::size_t>(list_.capacity() / 4, 1, kParts));
  std::uint32_t most_points = 0;
  for (const CutPart& part : parts_) most_points = std::max(most_points, shell_->nodes[part.node].count);
  levels_.bind(list_.capacity(), cut_limit(), most_points);
  begin_cut();
}

// Divides the tree into at most `parts` subtrees, by splitting the largest one repeatedly.
void ShellCandidates::divide(std::size_t parts) noexcept {
  parts_.clear();
  if (shell_ == nullptr || shell_->nodes.empty()) return;
  const auto& nodes = shell_->nodes;
  const auto largest_last = [&](const CutPart& a, const CutPart& b) {
    return nodes[a.node].radius_m < nodes[b.node].radius_m;
  };
  parts_.push_back({.node = 0});
  while (parts_.size() < parts) {
    const std::uint32_t largest = parts_.front().node;
    const ShellNode& node = nodes[largest];
    std::size_t children = 0;
    for (std::uint32_t i = largest + 1; i < node.next; i = nodes[i].next) ++children;
    if (node.is_leaf || parts_.size() + children > parts + 1) break;
    std::pop_heap(parts_.begin(), parts_.end(), largest_last);
    parts_.pop_back();
    for (std::uint32_t i = largest + 1; i < node.next; i = nodes[i].next) {
      parts_.push_back({.node = i});
      std::push_heap(parts_.begin(), parts_.end(), largest_last);
    }
  }
  std::sort(parts_.begin(), parts_.end(), [](const CutPart& a, const CutPart& b) { return a.node < b.node; });
}

ContactWork ShellCandidates::refresh(const Pose& X_FP, double band_m) noexcept {
  ContactWork& work = walk_.work;
  work = {};
  planes_.begin_step();
  levels_.begin_step();
  if (shell_ == nullptr || shell_->nodes.empty() || motion_.is_out_of_reach(X_FP, band_m)) return work;
  work.is_coarse = !levels_.is_fine();
  const bool is_at_rest = !levels_.is_first_cut() && band_m == band_m_ && is_same(X_FP, motion_.X_FP());
  // When the motion stops, one more step is searched, to measure the number of queries of a step without motion. This
  // number decides whether a finer level is tried.
  const bool has_rested = std::exchange(has_rested_, is_at_rest) || levels_.is_fine();
  if (is_at_rest && has_rested) {
    const std::uint32_t to_divide = queries_to_divide();
    if (to_divide == 0 && !levels_.may_be_finer(load(), false)) return work;
  }
  work.is_refreshed = true;
  move(X_FP);
  allow_band(band_m);
  search(band_m);
  levels_.end_first_cut();
  remember_gap();
  work.is_coarse = !levels_.is_fine();
  return work;
}

// Adds the motion of the step to each part.
void ShellCandidates::move(const Pose& X_FP) noexcept {
  motion_.move(X_FP);
  if (levels_.is_first_cut()) return;
  bool do_answers_hold = true;
  for (CutPart& part : parts_) {
    part.step_motion_m = motion_.moved_m(shell_->nodes[part.node]);
    part.moved_m += part.step_motion_m;
    if (!(part.moved_m > kSearch.farthest_m)) continue;
    restart_motion(part);
    do_answers_hold = false;
  }
  if (!do_answers_hold) planes_.clear();
}

// Sets the accumulated motion of a part back to zero, so that its bounds are accurate in single precision.
void ShellCandidates::restart_motion(CutPart& part) noexcept {
  for (CutNode& entry : std::span(cut_).subspan(part.begin, part.count)) {
    entry.query_again_at_m = rounded_down(entry.query_again_at_m - part.moved_m);
  }
  part.query_now();
  part.halves_check_at_m -= part.moved_m;
  part.moved_m = 0;
}

// Sets the band of this step. The bounds of points hold for the narrowest band so far, because the field's slope may
// exceed 1. If this band is narrower, a part of the difference is added to the accumulated motion, so that the bounds
// hold again.
void ShellCandidates::allow_band(double band_m) noexcept {
  band_m_ = band_m;
  if (band_m >= least_band_m_) return;
  if (std::isfinite(least_band_m_)) {
    for (CutPart& part : parts_) part.moved_m += (1 - 1 / kSteepest) * (least_band_m_ - band_m);
  }
  least_band_m_ = band_m;
}

// Stores the gap between shapes that are far apart, so that later steps only compare poses.
void ShellCandidates::remember_gap() noexcept {
  // Above level 0, only some points of a leaf may be sampled, so the gap is not known.
  if (!list_.all().empty() || levels_.level() > 0) return motion_.set_gap(-1);
  double gap_m = std::numeric_limits<double>::infinity();
  for (const CutPart& part : parts_) gap_m = std::min(gap_m, part.query_again_at_m - part.moved_m);
  motion_.set_gap(gap_m);
}

SearchLoad ShellCandidates::load() const {
  return {.near_count = list_.near_count(),
          .contacts = list_.contacts(),
          .cut_size = cut_.size(),
          .walk_points = walk_points_,
          .band_m = band_m_};
}

// Returns whether some part may have sampled nodes, which are represented by eight of their points.
bool ShellCandidates::has_sampled() const {
  return std::ranges::any_of(parts_, &CutPart::has_sampled);
}

std::uint32_t ShellCandidates::queries_to_divide() const {
  const std::uint32_t queries = levels_.queries_to_divide(load());
  return queries > 0 && has_sampled() ? queries : 0;
}

// Performs the search of one step. First, the level changes if the counts of the last walk require it. Then the cut is
// walked (traversed once). If the walk exceeds a limit, the step walks again at a coarser level, until a walk is
// complete.
void ShellCandidates::search(double band_m) noexcept {
  bool is_postponed = false;
  const auto switch_to_coarser = [&] {
    if (!std::exchange(is_postponed, true)) levels_.postpone_trial();
    begin_coarser();
  };
  if (levels_.is_too_dense()) {
    switch_to_coarser();
  } else if (levels_.may_be_finer(load(), queries_to_divide() > 0)) {
    if (has_room_finer(band_m)) return;
    is_postponed = true;
  }
  for (bool is_last = false; !walk(band_m) && !is_last; is_last = levels_.is_coarsest_level()) switch_to_coarser();
  levels_.note_load(load());
}

void ShellCandidates::begin_coarser() noexcept {
  const bool joins_pairs_first = levels_.joins_pairs_first();
  const int level = levels_.next_coarser_level(load());
  if (joins_pairs_first && join_pairs()) return;
  change_level(level);
}

// Tries a finer level. Returns false if the walk at that level exceeds a capacity or limit. In this case, the previous
// cut is restored. If it was too large to be stored, a coarser level begins instead.
bool ShellCandidates::has_room_finer(double band_m) noexcept {
  const bool is_kept = keep_cut();
  change_level(levels_.finer_level(load()));
  levels_.begin_trial();
  if (walk(band_m)) return true;
  levels_.fail_trial();
  if (is_kept) {
    restore_cut();
  } else {
    begin_coarser();
  }
  return false;
}

}  // namespace tandem::contact
