// Walk: one traversal of the cut. Entries whose bounds still hold are copied; all others are queried.
#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "common/contact/shell/shell_candidates.hpp"

namespace tandem::contact {

// Traverses the cut once and queries the nodes whose bounds no longer hold. Returns false if the cut or the list of
// candidates is full, or if the limit of queries is exceeded.
bool ShellCandidates::walk(double band_m) noexcept {
  walk_.divide_queries = queries_to_divide();
  walk_.divide_points = 0;
  std::swap(cut_, old_cut_);
  if (levels_.begins_to_join_far(old_cut_.size())) join_far();
  cut_.clear();
  list_.clear();
  walk_.may_check_halves = !field_->planes().empty();
  planes_.set_limit(levels_.plane_queries(band_m_));
  const std::uint32_t points_before = walk_.work.points;
  const std::uint32_t queries = levels_.walk_queries(band_m_) + walk_.divide_queries;
  walk_.query_limit =
      levels_.is_coarsest() ? std::numeric_limits<std::uint32_t>::max() : walk_.work.queries() + queries;
  const std::size_t divided_up_to = std::exchange(divided_up_to_, 0);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    walk_.divides_part = walk_.divide_queries > 0 && parts_[i].has_sampled && i >= divided_up_to;
    if (!walk_part(parts_[i], band_m)) {
      keep_rest(i);
      return false;
    }
    if (walk_.divides_part && walk_.divide_queries == 0) divided_up_to_ = i;
  }
  walk_points_ = walk_.work.points - points_before - walk_.divide_points;
  if (walk_.divide_queries > 0 && !has_sampled()) levels_.end_dividing();
  return true;
}

/// Computes distances before they are used: those of the next eight inner nodes of the cut that need a query. Their
/// memory accesses overlap in time, which reduces the total delay.
class ShellCandidates::Ahead {
 public:
  Ahead(const ShellCandidates& search, std::span<const CutNode> entries, double moved_m, double band_m)
      : search_(search), entries_(entries), moved_m_(moved_m), band_m_(band_m) {}

  /// Returns a lower bound of the distances of the next inner node that needs a query. Must be called once for each of
  /// these nodes, in their order.
  double next_nearest_m() noexcept {
    if (at_ == count_) query();
    return nearest_m_[at_++];
  }

 private:
  void query() noexcept {
    std::array<const ShellNode*, kEight> nodes;
    EightPlaces places_F;
    at_ = count_ = 0;
    for (; seen_ < entries_.size() && count_ < kEight; ++seen_) {
      const CutNode& entry = entries_[seen_];
      nodes[count_] = &search_.shell_->nodes[entry.node];
      count_ += !entry.is_leaf && !entry.is_known(moved_m_, band_m_) ? 1 : 0;
    }
    for (std::size_t i = 0; i < count_; ++i) {
      const Vec3 centre_F = search_.motion_.in_field(nodes[i]->centre_S);
      places_F.row(static_cast<Eigen::Index>(i)) = centre_F.transpose().array();
    }
    for (auto i = static_cast<Eigen::Index>(count_); i % 4 != 0; ++i) places_F.row(i) = places_F.row(i - 1);
    search_.field_->distances_m(places_F, count_, nearest_m_);
    for (std::size_t i = 0; i < count_; ++i) nearest_m_[i] = search_.nearest_m(*nodes[i], nearest_m_[i]);
  }

  const ShellCandidates& search_;
  std::span<const CutNode> entries_;
  double moved_m_, band_m_;
  std::size_t seen_ = 0, at_ = 0, count_ = 0;
  EightNumbers nearest_m_;
};

bool ShellCandidates::walk_part(CutPart& part, double band_m) noexcept {
  const auto entries = std::span(old_cut_).subspan(part.begin, part.count);
  const auto begin = static_cast<std::uint32_t>(cut_.size());
  const bool is_slow = part.step_motion_m < kSearch.slow_m;
  const bool is_due =
      walk_.may_check_halves && (part.moved_m > part.halves_check_at_m || (part.waits_for_rest && is_slow));
  if (!is_due && !walk_.divides_part && part.moved_m + band_m < part.query_again_at_m) {
    if (cut_.size() + entries.size() > cut_limit()) return false;
    cut_.insert(cut_.end(), entries.begin(), entries.end());
  } else {
    walk_.root = part.node;
    planes_.begin_part();
    walk_.has_sampled = false;
    walk_.first_at_m = std::numeric_limits<float>::infinity();
    const bool is_whole = is_due && part.has_open_question;
    if (is_whole && !open(part.node, nearest_m(shell_->nodes[part.node]), part.moved_m, band_m)) return false;
    Ahead ahead(*this, entries, part.moved_m, band_m);
    bool was_queried = false;  // true: the previous entry was queried
    for (std::size_t i = 0; i < entries.size() && !is_whole; ++i) {
      if (!was_queried && !is_due && !walk_.divides_part) i += append_known(entries.subspan(i), part.moved_m, band_m);
      if (i == entries.size()) break;
      const CutNode& entry = entries[i];
      bool has_room = false;
      const bool is_known = entry.is_known(part.moved_m, band_m);
      const bool is_divided = entry.is_sampled && walk_.divides_part && walk_.divide_queries > 0;
      if (is_divided) {
        has_room = open_children(entry.node, part.moved_m, band_m);
        if (!is_known && !entry.is_leaf) ahead.next_nearest_m();
      } else if (!is_known) {
        // The memory of the next leaf is prefetched while this entry is queried.
        if (i + 1 < entries.size() && entries[i + 1].is_leaf && !entries[i + 1].is_known(part.moved_m, band_m)) {
          LeafSamples::prefetch(*shell_, shell_->nodes[entries[i + 1].node]);
        }
        has_room = entry.is_leaf ? open_leaf(entry, part.moved_m, band_m)
                                 : open(entry.node, ahead.next_nearest_m(), part.moved_m, band_m);
      } else if (entry.planes != 0) {
        has_room = list_.add_planes(entry.node, entry.planes) && append(entry);
      } else {
        has_room = was_queried ? keep(entry, part.moved_m, band_m) : append(entry);
      }
      if (!has_room || (is_due && !join_above_planes(part.moved_m, band_m))) return false;
      was_queried = !is_known || is_divided;
    }
    walk_.may_check_halves = walk_.may_check_halves && !is_due;
    plan_halves_check(part, is_due, 5 * (cut_.size() - begin) <= 4 * entries.size());
    part.query_again_at_m = walk_.first_at_m;
    part.has_sampled = walk_.has_sampled;
  }
  part.begin = begin;
  part.count = static_cast<std::uint32_t>(cut_.size()) - begin;
  return true;
}

// Sets the accumulated motion at which the part is next checked for two halves of a node that is above planes. The node
// can replace these halves.
//
// In      was_worth_it  true: this walk reduced the number of entries by at least a fifth
void ShellCandidates::plan_halves_check(CutPart& part, bool is_due, bool was_worth_it) noexcept {
  const bool is_slow = part.step_motion_m < kSearch.slow_m;
  if (planes_.has_open_question() && levels_.is_new_level()) {
    part.has_open_question = true;
    part.halves_check_at_m = part.moved_m;
  } else if (is_due && planes_.has_open_question()) {
    // The check is incomplete, because the limit of plane queries was reached. In slow motion, results of plane queries
    // remain valid for several steps, so the check continues in the next step. In fast motion, they become invalid too
    // soon, so the check is postponed.
    part.waits_for_rest = !is_slow;
    part.halves_check_at_m = part.moved_m + (is_slow ? 0 : share_of(part.node) * kSearch.max_halves_check_motion_m);
  } else if (is_due) {
    part.halves_check_after_m = was_worth_it
                                    ? kSearch.halves_check_motion_m
                                    : std::min(2 * part.halves_check_after_m, kSearch.max_halves_check_motion_m);
    part.halves_check_at_m = part.moved_m + share_of(part.node) * part.halves_check_after_m;
    part.has_open_question = part.waits_for_rest = false;
  }
}

// Appends an entry that is not above planes. If this entry and the previous one are halves of the same node, and the
// bounds of both allow enough motion (see kSearch.join_at), the node replaces them. Returns false if the cut is full.
bool ShellCandidates::keep(const CutNode& entry, double moved_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  const auto known_at_m = static_cast<float>(moved_m + band_m);
  const float full = static_cast<float>(cut_.size()) / static_cast<float>(cut_limit());
  const float share = levels_.is_first_cut() ? 0 : kSearch.join_at * (1 - full);
  std::uint32_t node = entry.node;
  float at_m = entry.query_again_at_m;
  bool is_sampled = entry.is_sampled;
  while (!cut_.empty() && entry.planes == 0 && at_m > known_at_m && node != walk_.root) {
    const CutNode& before = cut_.back();
    if (!(before.query_again_at_m > known_at_m) || before.planes != 0 || before.node <= walk_.root) break;
    // If this walk divides the part, sampled nodes are not joined, since that would undo the dividing.
    if (walk_.divides_part && (is_sampled || before.is_sampled)) break;
    const std::uint32_t parent = before.node - 1;
    if (nodes[before.node].next != node || nodes[parent].is_leaf || nodes[parent].next != nodes[node].next) break;
    const float first_at_m = std::min(before.query_again_at_m, at_m);
    if (!(first_at_m > known_at_m + share * nodes[parent].radius_m)) break;
    at_m = first_at_m;
    is_sampled = is_sampled || before.is_sampled;
    node = parent;
    cut_.pop_back();
  }
  return node == entry.node ? append(entry)
                            : append({.node = node, .query_again_at_m = at_m, .is_sampled = is_sampled});
}

// Copies entries up to the first one that is above planes or must be queried. Returns the number of copied entries.
std::size_t ShellCandidates::append_known(std::span<const CutNode> entries, double moved_m, double band_m) noexcept {
  const auto most = std::min(entries.size(), cut_limit() - cut_.size());
  std::size_t count = 0;
  float first_at_m = walk_.first_at_m;
  bool has_sampled = walk_.has_sampled;
  for (; count < most && entries[count].planes == 0 && entries[count].is_known(moved_m, band_m); ++count) {
    first_at_m = std::min(first_at_m, entries[count].query_again_at_m);
    has_sampled = has_sampled || entries[count].is_sampled;
  }
  walk_.first_at_m = first_at_m;
  walk_.has_sampled = has_sampled;
  cut_.insert(cut_.end(), entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(count));
  return count;
}

bool ShellCandidates::append(const CutNode& entry) noexcept {
  if (cut_.size() >= cut_limit()) return false;
  walk_.first_at_m =
      std::min(walk_.first_at_m, entry.planes != 0 ? -std::numeric_limits<float>::infinity() : entry.query_again_at_m);
  walk_.has_sampled = walk_.has_sampled || entry.is_sampled;
  cut_.push_back(entry);
  return true;
}

}  // namespace tandem::contact
