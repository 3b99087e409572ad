// Chooses the level of a shell's tree at which candidates are made. The decisions depend only on measured numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "common/contact/points/point_shell.hpp"
#include "common/contact/shell/search_settings.hpp"

namespace tandem::contact {

/// State of the level policy.
///
/// LevelPolicy stores two flags beside the phase. `is_divided_trial_` records that the current level began as a trial,
/// also after its nodes were divided; the next interval of trials depends on it. `tries_when_divided_` is set after a
/// failed trial if nodes remain to be divided. The next trial then begins as soon as all are divided.
enum class SearchPhase : std::uint8_t {
  kFirstCut,  ///< no step has ended since bind(), so no bound exists yet
  kFine,      ///< all near points are single candidates
  kCoarse,    ///< larger leaves, each with at most two candidates
  kDividing,  ///< sampled nodes of a coarse level were replaced by their children
  kTrial,     ///< the level began as a trial of a finer one; lasts until the next change of the level
};

/// Measurements of the last walk, and the band of the current step.
struct SearchLoad {
  std::size_t near_count = 0;     ///< estimated number of near points
  std::size_t contacts = 0;       ///< contacts that the candidates need
  std::size_t cut_size = 0;       ///< entries of the cut
  std::uint32_t walk_points = 0;  ///< points that the last complete walk queried
  double band_m = 0;
};

/// Decides in each step at which level the tree is walked, and how many queries the walk may make.
///
/// Model   States and transitions as in SEARCH.md. At kFineLevel, candidates are single points. At level n ≥ 0, a leaf
///         has at most 8 × 2ⁿ points if it is far, and 8 × 2^max(0, n − 4) if it may press. The level becomes coarser
///         after a walk with too many contacts or queries. It becomes finer by trials
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
  /// Ends the first cut, after the first step.
  void end_first_cut() noexcept;

  int level() const { return level_; }
  SearchPhase phase() const { return phase_; }
  bool is_fine() const { return level_ == kFineLevel; }
  bool is_first_cut() const { return phase_ == SearchPhase::kFirstCut; }
  /// Returns whether the search cannot become coarser: the level is the coarsest, and no divided nodes could be joined.
  bool is_coarsest() const { return level_ == coarsest_level_ && phase_ != SearchPhase::kDividing; }
  /// Returns whether each part is a single leaf, until it is divided.
  bool is_coarsest_level() const { return level_ == coarsest_level_; }
  /// Returns whether the level began in this step.
  bool is_new_level() const { return steps_at_level_ <= 1; }
  static bool is_wide(double band_m) { return band_m > kSearch.wide_band_m; }

  /// Returns the largest number of points of a node that is treated as a leaf at this distance.
  std::uint32_t leaf_points(double nearest_m) const { return is_fine() ? 0 : leaf_points_of(level_, nearest_m); }
  /// Returns the number of queries that a usual step may use.
  std::uint32_t max_queries() const { return static_cast<std::uint32_t>(kSearch.queries_per_candidate * capacity_); }
  /// Returns the limit of a walk's queries, without those for dividing.
  std::uint32_t walk_queries(double band_m) const;
  /// Returns the limit of the table entries of the field that new plane queries of a step may read.
  std::size_t plane_queries(double band_m) const;
  /// Returns the number of queries that a step may use to divide sampled nodes. If a finer level needs too many queries
  /// for one step, dividing spreads them over several steps.
  std::uint32_t queries_to_divide(const SearchLoad& load) const;
  /// Returns whether far nodes are joined in this walk. If so, the interval until the next joining begins.
  bool begins_to_join_far(std::size_t cut_size) noexcept;

  /// Returns whether the last steps had too many queries.
  bool is_too_dense() const { return dense_steps_ > kSearch.max_dense_steps; }
  /// Returns whether a trial of a finer level starts now.
  ///
  /// In      is_dividing  true: sampled nodes are divided in this step, whereas a finer level would query all of them
  ///         at once
  bool may_be_finer(const SearchLoad& load, bool is_dividing) const;
  /// Returns the level of the next trial.
  int finer_level(const SearchLoad& load) const;
  /// Returns the level after a walk without room. The level stays the same if divided nodes must be joined first.
  int next_coarser_level(const SearchLoad& load) noexcept;
  /// Returns whether pairs of divided nodes are joined before the level changes. This happens at the coarsest level if
  /// the last steps had too many queries.
  bool joins_pairs_first() const { return phase_ == SearchPhase::kDividing && is_too_dense() && is_coarsest_level(); }
  /// Postpones the next trial. The interval doubles if the level of the last trial did not last. It remains the same if
  /// dividing caused the lack of room.
  void postpone_trial() noexcept;

  /// Begins a level. If it is the current level, all divided nodes of the level have been joined.
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
  /// Returns whether a level has the same leaves near the surface as level 0: the band is so narrow that all points
  /// within it may press.
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
  bool is_divided_trial_ = false;      ///< in kDividing: the level began as a trial
  bool tries_when_divided_ = false;    ///< the last trial failed, and nodes remain to be divided
  std::uint32_t steps_at_level_ = 0;   ///< steps since the level began
  std::uint32_t steps_of_join_ = 0;    ///< value of steps_at_level_ when far nodes were last joined
  std::uint32_t steps_to_try_ = 0;     ///< steps until a finer level is tried
  std::uint32_t steps_per_try_ = 0;    ///< interval of trials
  std::uint32_t steps_to_divide_ = 0;  ///< steps at a level until dividing begins
  std::uint32_t dense_steps_ = 0;      ///< consecutive steps with too many queries
};

}  // namespace tandem::contact
