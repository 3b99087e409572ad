#include "common/contact/shell/level_policy.hpp"

#include <utility>

namespace tandem::contact {
namespace {

bool is_at_most(std::size_t used, double share, std::size_t limit) {
  return static_cast<double>(used) <= share * static_cast<double>(limit);
}

}  // namespace

void LevelPolicy::bind(std::uint32_t capacity, std::size_t cut_limit, std::uint32_t most_points) noexcept {
  capacity_ = capacity;
  cut_limit_ = cut_limit;
  for (coarsest_level_ = 0; leaf_points_of(coarsest_level_, 0) < most_points;) ++coarsest_level_;
  phase_ = SearchPhase::kFirstCut;
  tries_when_divided_ = false;
  steps_to_try_ = 0;
  steps_per_try_ = kSearch.steps_per_try;
  steps_to_divide_ = kSearch.steps_to_divide;
  set_level(kFineLevel);
}

void LevelPolicy::begin_step() noexcept {
  if (steps_to_try_ > 0) --steps_to_try_;
  ++steps_at_level_;
}

// Counts consecutive steps with too many queries. If few points are near, more queries are allowed. A coarser level
// would then lose accuracy, because it samples only eight points of its larger leaves.
void LevelPolicy::note_load(const SearchLoad& load) noexcept {
  // Two cases have many queries but few pressing points. If parallel surfaces are just beyond the band, few points are
  // near. In fast motion, the band is wide, and most near points do not press.
  const bool is_near = load.near_count > capacity_ && !is_wide(load.band_m);
  const bool is_next_as_fine = coarser_level(false, load.band_m) <= kSearch.finer_where_pressed;
  const double more = is_near ? 1 : is_next_as_fine ? kSearch.query_margin : kSearch.query_margin_else;
  const bool is_over = load.walk_points > more * max_queries();
  const bool is_dense = is_over && !is_coarsest();
  dense_steps_ = is_dense ? dense_steps_ + 1 : 0;
}

void LevelPolicy::end_first_cut() noexcept {
  if (is_first_cut()) phase_ = is_fine() ? SearchPhase::kFine : SearchPhase::kCoarse;
}

std::uint32_t LevelPolicy::walk_queries(double band_m) const {
  const std::uint32_t share = is_first_cut()                        ? kSearch.first_cut_queries
                              : began_as_trial() || !is_new_level() ? kSearch.walk_queries
                                                                    : kSearch.new_level_queries;
  return (is_wide(band_m) ? 2 : 1) * share * max_queries();
}

std::size_t LevelPolicy::plane_queries(double band_m) const {
  if (is_first_cut() || is_wide(band_m)) return kSearch.first_plane_queries;
  return is_new_level() ? kSearch.new_level_plane_queries : kSearch.plane_queries;
}

std::uint32_t LevelPolicy::queries_to_divide(const SearchLoad& load) const {
  if (is_fine() || is_first_cut() || steps_at_level_ < steps_to_divide_) return 0;
  const bool has_room = is_at_most(load.contacts, kSearch.divided_below, capacity_) &&
                        is_at_most(load.cut_size, kSearch.divided_cut_below, cut_limit_);
  return has_room ? max_queries() - std::min(max_queries(), kSearch.queries_per_point * load.walk_points) : 0;
}

bool LevelPolicy::begins_to_join_far(std::size_t cut_size) noexcept {
  const bool is_full = !is_at_most(cut_size, kSearch.join_far_above, cut_limit_);
  if (!is_full || is_fine() || steps_at_level_ <= kSearch.steps_to_join + steps_of_join_) return false;
  steps_of_join_ = steps_at_level_;
  return true;
}

bool LevelPolicy::may_be_finer(const SearchLoad& load, bool is_dividing) const {
  if (is_fine() || is_dividing) return false;
  const bool has_failed = steps_per_try_ > kSearch.steps_per_try;
  const bool is_little_near = is_at_most(load.near_count, kSearch.finest_below, capacity_);
  const bool is_early = is_little_near && !has_failed;
  if (steps_to_try_ > (is_early ? kSearch.steps_per_try - kSearch.steps_to_finest : 0)) return false;
  if (is_little_near) return true;
  if (level_ == 0 || acts_as_level_0(level_, load.band_m)) {
    return is_at_most(load.near_count, kSearch.finer_below, capacity_) && load.walk_points <= max_queries();
  }
  return is_at_most(load.contacts, kSearch.finer_level_below, capacity_) &&
         (load.near_count <= capacity_ || 2 * load.walk_points <= max_queries());
}

int LevelPolicy::finer_level(const SearchLoad& load) const {
  if (is_at_most(load.near_count, kSearch.finest_below, capacity_) || acts_as_level_0(level_, load.band_m)) {
    return kFineLevel;
  }
  return acts_as_level_0(level_ - 1, load.band_m) ? 0 : level_ - 1;
}

int LevelPolicy::next_coarser_level(const SearchLoad& load) noexcept {
  if (phase_ == SearchPhase::kDividing) {
    steps_to_divide_ = std::min(2 * steps_to_divide_, kSearch.max_steps_per_try);
    return level_;
  }
  steps_to_divide_ = kSearch.steps_to_divide;
  return coarser_level(load.contacts > capacity_ && dense_steps_ == 0, load.band_m);
}

// Returns the next coarser level:
// * After the finest level, level 0 is used only if there are too many contacts. It merges the points of a leaf, but
//   needs as many queries.
// * Above level 1, every second level is skipped.
// * A level whose near leaves are as small as those of level 0 is skipped.
int LevelPolicy::coarser_level(bool has_too_many, double band_m) const {
  const int next = is_fine() && !has_too_many ? 1 : level_ <= 0 ? level_ + 1 : level_ + 2;
  return std::min(acts_as_level_0(next, band_m) ? kSearch.finer_where_pressed + 1 : next, coarsest_level_);
}

void LevelPolicy::postpone_trial() noexcept {
  const bool has_failed = began_as_trial() && steps_at_level_ < steps_per_try_;
  const bool is_divided = phase_ == SearchPhase::kDividing;
  set_interval(has_failed ? 2 * steps_per_try_ : is_divided ? steps_per_try_ : kSearch.steps_per_try);
}

void LevelPolicy::set_interval(std::uint32_t steps) noexcept {
  steps_per_try_ = std::min(steps, kSearch.max_steps_per_try);
  steps_to_try_ = steps_per_try_;
}

void LevelPolicy::set_level(int level) noexcept {
  level_ = level;
  if (!is_first_cut()) phase_ = is_fine() ? SearchPhase::kFine : SearchPhase::kCoarse;
  is_divided_trial_ = false;
  steps_at_level_ = steps_of_join_ = 0;
  dense_steps_ = 0;
}

void LevelPolicy::begin_trial() noexcept {
  phase_ = SearchPhase::kTrial;
  steps_to_try_ = steps_per_try_;
}

void LevelPolicy::fail_trial() noexcept {
  set_interval(2 * steps_per_try_);
}

void LevelPolicy::restore(const LevelPolicy& before, bool has_sampled) noexcept {
  set_level(before.level_);
  steps_at_level_ = before.steps_at_level_;
  if (before.phase_ == SearchPhase::kDividing) phase_ = SearchPhase::kDividing;
  tries_when_divided_ = has_sampled;
}

void LevelPolicy::note_divided() noexcept {
  is_divided_trial_ = began_as_trial();
  phase_ = SearchPhase::kDividing;
}

void LevelPolicy::end_dividing() noexcept {
  steps_to_divide_ = kSearch.steps_to_divide;
  if (std::exchange(tries_when_divided_, false)) steps_to_try_ = 0;
}

}  // namespace tandem::contact
