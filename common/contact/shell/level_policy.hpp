// Chooses the level of the search: how large the nodes are whose points become candidates. The decisions depend only on
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
/// LevelPolicy stores two flags beside the phase. `is_divided_trial_`: the current level began as a trial and its nodes
/// were divided since; the flag sets the interval to the next trial. `tries_when_divided_`: a trial has failed while
/// sampled nodes remained. The next trial then begins as soon as no sampled node is left.
enum class SearchPhase : std::uint8_t {
  kFirstCut,  ///< no step has ended since bind(), so no bound exists yet
  kFine,      ///< all near points are single candidates
  kCoarse,    ///< leaves are larger than at kFine, and each gives at most two candidates
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
/// Model   States and transitions as in SEARCH.md. At kFineLevel, candidates are single points. At level n ≥ 0, a leaf
///         has at most 8 × 2ⁿ points if it is far. It has at most 8 × 2^max(0, n − 4) points if it may press. The level
///         becomes coarser after a walk with too many contacts or queries. It becomes finer by trials
/// Thread  any; no allocation
class LevelPolicy {
 public:
  static constexpr int kFineLevel = -1;

  /// Begins at the finest level, with a first cut.
  ///
  /// In      capacity     largest number of contacts of the search
  ///         cut_limit    largest number of entries of the cut
  ///         most_points  number of points of the largest part; at the coarsest level each part is one leaf
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
  /// Returns whether no coarser search is possible: the level is the coarsest, and there are no divided nodes to join.
  bool is_coarsest() const { return level_ == coarsest_level_ && phase_ != SearchPhase::kDividing; }
  /// Returns whether the level is the coarsest, where each part is a single leaf until it is divided.
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
  /// Returns the number of queries that a step may use to divide sampled nodes. Dividing needs several steps if a finer
  /// level needs more queries than one step may use.
  std::uint32_t queries_to_divide(const SearchLoad& load) const;
  /// Returns whether this walk joins far nodes. If so, restarts the interval between joinings.
  bool begins_to_join_far(std::size_t cut_size) noexcept;

  /// Returns whether the last steps had too many queries.
  bool is_too_dense() const { return dense_steps_ > kSearch.max_dense_steps; }
  /// Returns whether a trial of a finer level starts now.
  ///
  /// In      is_dividing  true: this step divides sampled nodes. A finer level instead would query all of them at once
  bool may_be_finer(const SearchLoad& load, bool is_dividing) const;
  /// Returns the level of the next trial.
  int finer_level(const SearchLoad& load) const;
  /// Returns the level after a walk that exceeded a capacity. The level stays the same if divided nodes must be joined
  /// first.
  int next_coarser_level(const SearchLoad& load) noexcept;
  /// Returns whether pairs of divided nodes are joined before the level changes. This happens at the coarsest level if
  /// the last steps had too many queries.
  bool joins_pairs_first() const { return phase_ == SearchPhase::kDividing && is_too_dense() && is_coarsest_level(); }
  /// Postpones the next trial. The interval doubles if the level of the last trial was left soon. The interval remains
  /// the same if dividing had used up the capacity.
  void postpone_trial() noexcept;

  /// Begins a level. If it is the current level, all divided nodes of the level have been joined before the call.
  void set_level(int level) noexcept;
  /// Marks the level that was just set as a trial.
  void begin_trial() noexcept;
  /// Doubles the interval of trials.
  void fail_trial() noexcept;
  /// Returns to the state before a failed trial. The restored level does not count as a trial, even if it began as one.
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
  /// Returns whether a level has the same leaves near the surface as level 0. This is so in a band that is so narrow
  /// that all near points may press.
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
  bool is_divided_trial_ = false;      ///< true in kDividing: the level began as a trial
  bool tries_when_divided_ = false;    ///< true: the last trial failed, and nodes remain to be divided
  std::uint32_t steps_at_level_ = 0;   ///< steps since the level began
  std::uint32_t steps_of_join_ = 0;    ///< steps at this level when far nodes were last joined
  std::uint32_t steps_to_try_ = 0;     ///< steps until a finer level is tried
  std::uint32_t steps_per_try_ = 0;    ///< interval between trials, in steps
  std::uint32_t steps_to_divide_ = 0;  ///< steps at a level before dividing begins
  std::uint32_t dense_steps_ = 0;      ///< consecutive steps with too many queries
};

}  // namespace tandem::contact
