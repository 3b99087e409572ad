// Chooses the level of the search, that is, the size of the nodes that are used as leaves. The decisions depend only on
// counts of queries, points and contacts, never on time. SEARCH.md and cut_node.hpp define the terms.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "common/contact/points/point_shell.hpp"
#include "common/contact/shell/search_settings.hpp"

namespace tandem::contact {

/// Phase of the level policy.
///
/// LevelPolicy stores two flags beside the phase:
/// * `is_divided_trial_`: the current level began as a trial, and its nodes were divided later. If this level ends
///   early, the interval between trials doubles.
/// * `tries_when_divided_`: a trial has failed while the cut had sampled nodes. The next trial begins as soon as all of
///   them are divided.
enum class SearchPhase : std::uint8_t {
  kFirstCut,  ///< no step has ended since bind(), so no bound exists yet
  kFine,      ///< all near points are single candidates
  kCoarse,    ///< the points of a leaf are merged into at most two candidates
  kDividing,  ///< sampled nodes of a coarse level were replaced by their children
  kTrial,     ///< trial of a finer level; the phase ends when the level changes or nodes are divided
};

/// Measurements of the last walk (traversal of the cut), and the band of the current step.
struct SearchLoad {
  std::size_t near_count = 0;     ///< estimated number of near points
  std::size_t contacts = 0;       ///< contacts that the candidates need
  std::size_t cut_size = 0;       ///< number of entries of the cut
  std::uint32_t walk_points = 0;  ///< number of points that the last complete walk queried
  double band_m = 0;
};

/// Decides in each step at which level the tree is walked, and how many queries the walk may make.
///
/// Model   SEARCH.md has a diagram of the phases. Levels:
///         * kFineLevel (−1): each near point is a candidate.
///         * n ≥ 0: the points of a leaf are merged. A far leaf has at most 8 × 2ⁿ points. A leaf that may press before
///           its next query has at most 8 × 2^max(0, n − 4).
///         The level becomes coarser after a walk (traversal) with too many contacts or queries. It becomes finer by
///         trials
/// Thread  any; no allocation
class LevelPolicy {
 public:
  static constexpr int kFineLevel = -1;

  /// Begins the search of a new pair: at the finest level, in the phase kFirstCut.
  ///
  /// In      capacity     largest number of contacts that the candidates may need
  ///         cut_limit    largest number of entries of the cut
  ///         most_points  number of points of the largest part. The coarsest level is the one at which each part is one
  ///         leaf
  void bind(std::uint32_t capacity, std::size_t cut_limit, std::uint32_t most_points) noexcept;
  /// Counts a step. Called before all other functions of that step.
  void begin_step() noexcept;
  /// Counts consecutive steps with too many queries. Called after a step without a successful trial.
  void note_load(const SearchLoad& load) noexcept;
  /// Ends the phase kFirstCut, after the first step.
  void end_first_cut() noexcept;

  int level() const { return level_; }
  SearchPhase phase() const { return phase_; }
  bool is_fine() const { return level_ == kFineLevel; }
  bool is_first_cut() const { return phase_ == SearchPhase::kFirstCut; }
  /// Returns whether a coarser search is impossible: the level is the coarsest, and no node was divided at this level.
  bool is_coarsest() const { return level_ == coarsest_level_ && phase_ != SearchPhase::kDividing; }
  /// Returns whether the level is the coarsest, even if nodes were divided at this level. At this level, each part is
  /// one leaf.
  bool is_coarsest_level() const { return level_ == coarsest_level_; }
  /// Returns whether the level began in this step.
  bool is_new_level() const { return steps_at_level_ <= 1; }
  static bool is_wide(double band_m) { return band_m > kSearch.wide_band_m; }

  /// Returns the largest number of points of a node that is treated as a leaf at this distance.
  std::uint32_t leaf_points(double nearest_m) const { return is_fine() ? 0 : leaf_points_of(level_, nearest_m); }
  /// Returns the number of queries that a usual step may use.
  std::uint32_t max_queries() const { return static_cast<std::uint32_t>(kSearch.queries_per_candidate * capacity_); }
  /// Returns the limit of a walk's queries. Queries for dividing are not included.
  std::uint32_t walk_queries(double band_m) const;
  /// Returns the limit of a step's new plane queries: the number of entries that they may read from the field's table
  /// of planes.
  std::size_t plane_queries(double band_m) const;
  /// Returns the number of queries that a step may use to divide sampled nodes. If a finer level needs more queries
  /// than this, dividing continues in the following steps.
  std::uint32_t queries_to_divide(const SearchLoad& load) const;
  /// Returns whether far nodes are joined (replaced by their parents) in this step. If so, the interval until the next
  /// joining begins.
  bool begins_to_join_far(std::size_t cut_size) noexcept;

  /// Returns whether the last steps had too many queries.
  bool is_too_dense() const { return dense_steps_ > kSearch.max_dense_steps; }
  /// Returns whether a trial of a finer level starts now.
  ///
  /// In      is_dividing  true: this step divides sampled nodes, so no trial starts. A finer level would query all of
  ///         them at once
  bool may_be_finer(const SearchLoad& load, bool is_dividing) const;
  /// Returns the level of the next trial.
  int finer_level(const SearchLoad& load) const;
  /// Returns the level for the next walk of this step, after a walk that exceeded a capacity. It is the current level
  /// if divided nodes of this level can be joined instead.
  int next_coarser_level(const SearchLoad& load) noexcept;
  /// Returns whether pairs of divided nodes must be joined instead of changing the level. This is so at the coarsest
  /// level if the last steps had too many queries.
  bool joins_pairs_first() const { return phase_ == SearchPhase::kDividing && is_too_dense() && is_coarsest_level(); }
  /// Postpones the next trial, before the search becomes coarser. Interval until that trial:
  /// * doubled, if the current level began as a trial and ends early
  /// * unchanged, if the nodes of the current level were divided
  /// * the shortest one otherwise
  void postpone_trial() noexcept;

  /// Begins a level. The current level may be begun again, after all its divided nodes have been joined.
  void set_level(int level) noexcept;
  /// Marks the level that was just set as a trial.
  void begin_trial() noexcept;
  /// Doubles the interval of trials.
  void fail_trial() noexcept;
  /// Restores the state before a failed trial. The restored level no longer counts as a trial itself.
  ///
  /// In      has_sampled  whether the cut has sampled nodes
  void restore(const LevelPolicy& before, bool has_sampled) noexcept;
  /// Records that sampled nodes were replaced by their children.
  void note_divided() noexcept;
  /// Records that all sampled nodes are divided. A finer level now needs few queries, so its trial may start at once.
  void end_dividing() noexcept;

 private:
  static std::uint32_t leaf_points_of(int level, double nearest_m) {
    const int doublings = nearest_m > kSearch.may_press_m ? level : std::max(0, level - kSearch.finer_where_pressed);
    return kShellLeafPoints << static_cast<unsigned>(doublings);
  }
  /// Returns whether the near leaves of a level are as small as those of level 0. This is so at levels 1 to 4 if the
  /// band is so narrow that every near leaf may press.
  static bool acts_as_level_0(int level, double band_m) {
    return level > 0 && level <= kSearch.finer_where_pressed && band_m <= kSearch.may_press_m;
  }
  bool began_as_trial() const { return phase_ == SearchPhase::kTrial || is_divided_trial_; }
  int coarser_level(bool has_too_many, double band_m) const;
  void set_interval(std::uint32_t steps) noexcept;

  std::uint32_t capacity_ = 0;
  std::size_t cut_limit_ = 0;
  int coarsest_level_ = 0;
  int level_ = kFineLevel;
  SearchPhase phase_ = SearchPhase::kFirstCut;
  bool is_divided_trial_ = false;      ///< used in the phase kDividing; true: the current level began as a trial
  bool tries_when_divided_ = false;    ///< true: the last trial failed, and the cut still has sampled nodes
  std::uint32_t steps_at_level_ = 0;   ///< steps since the level began
  std::uint32_t steps_of_join_ = 0;    ///< value of steps_at_level_ when far nodes were last joined
  std::uint32_t steps_to_try_ = 0;     ///< steps until a finer level is tried
  std::uint32_t steps_per_try_ = 0;    ///< interval between trials, in steps
  std::uint32_t steps_to_divide_ = 0;  ///< steps at a level before dividing begins
  std::uint32_t dense_steps_ = 0;      ///< consecutive steps with too many queries
};

}  // namespace tandem::contact
