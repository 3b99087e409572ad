// Functions that change the whole cut: they change its level, join nodes, or restore entries after an incomplete walk.
// SEARCH.md and cut_node.hpp define the terms.
#include <algorithm>
#include <limits>
#include <utility>

#include "common/contact/shell/shell_candidates.hpp"

namespace tandem::contact {

// Starts a new cut. It has one entry for each part: the part's root node, whose distance is not known yet.
void ShellCandidates::begin_cut() noexcept {
  cut_.clear();
  for (CutPart& part : parts_) {
    part.begin = static_cast<std::uint32_t>(cut_.size());
    part.count = 1;
    part.query_now();
    part.halves_check_after_m = kSearch.halves_check_motion_m;
    part.halves_check_at_m = part.moved_m + share_of(part.node) * kSearch.halves_check_motion_m;
    part.has_open_question = part.waits_for_rest = false;
    cut_.push_back(CutNode::unknown(part.node));
  }
}

// Changes the level. Entries of the old cut remain where their distance bounds are still valid. In two cases a new cut
// begins instead: at the coarsest level, and in a wide band, because few bounds would remain valid.
void ShellCandidates::change_level(int level) noexcept {
  const bool is_finer = level < levels_.level();
  levels_.set_level(level);
  if (levels_.is_coarsest_level() || LevelPolicy::is_wide(band_m_)) return begin_cut();
  std::swap(cut_, old_cut_);
  cut_.clear();
  for (CutPart& part : parts_) {
    const auto entries = std::span(old_cut_).subspan(part.begin, part.count);
    part.begin = static_cast<std::uint32_t>(cut_.size());
    for (const CutNode& entry : entries) {
      if (!is_finer) {
        append_as_coarse(entry, part);
      } else {
        const bool is_fine = entry.is_leaf && shell_->nodes[entry.node].count <= levels_.leaf_points(0);
        const bool is_divided = entry.is_sampled && !is_fine;
        cut_.push_back(is_divided ? CutNode::unknown(entry.node) : entry);
        if (is_divided) part.query_now();
      }
    }
    part.count = static_cast<std::uint32_t>(cut_.size()) - part.begin;
  }
}

// Appends an entry during the change to a coarser level. The parent replaces this entry and the previous one under
// three conditions: they are its two halves, at least one of them is near, and the parent is small enough for a leaf of
// the new level. This is repeated for the parent.
void ShellCandidates::append_as_coarse(CutNode entry, CutPart& part) noexcept {
  const auto& nodes = shell_->nodes;
  const std::uint32_t most_points = levels_.leaf_points(std::numeric_limits<double>::infinity());
  const auto is_near = [](const CutNode& a) {
    return a.is_leaf || a.planes != 0 || !(a.query_again_at_m > -std::numeric_limits<float>::infinity());
  };
  const auto query = [&](std::uint32_t node) {
    entry = CutNode::unknown(node);
    part.query_now();
  };
  if (entry.planes != 0 && nodes[entry.node].count <= std::min(most_points, kSearch.planes_above)) query(entry.node);
  while (cut_.size() > part.begin) {
    const CutNode& before = cut_.back();
    if (before.node <= part.node || nodes[before.node].next != entry.node || !(is_near(before) || is_near(entry)))
      break;
    const ShellNode& parent = nodes[before.node - 1];
    if (parent.is_leaf || parent.count > most_points || parent.next != nodes[entry.node].next) break;
    query(before.node - 1);
    cut_.pop_back();
  }
  cut_.push_back(entry);
}

// Undoes the last step of dividing: each pair of halves, of which at least one is a sampled node, is replaced by its
// parent. Returns false if there was no such pair. Only one step is undone at a time. Undoing all of them would leave
// only eight sampled points for each part.
bool ShellCandidates::join_pairs() noexcept {
  const auto& nodes = shell_->nodes;
  bool is_any_joined = false;
  levels_.set_level(levels_.level());
  std::swap(cut_, old_cut_);
  cut_.clear();
  for (CutPart& part : parts_) {
    const auto entries = std::span(old_cut_).subspan(part.begin, part.count);
    part.begin = static_cast<std::uint32_t>(cut_.size());
    bool was_joined = false;
    for (const CutNode& entry : entries) {
      cut_.push_back(entry);
      if (std::exchange(was_joined, false) || cut_.size() < part.begin + 2) continue;
      const CutNode& before = cut_[cut_.size() - 2];
      const std::uint32_t parent = before.node - 1;
      if (before.node <= part.node || nodes[before.node].next != entry.node || nodes[parent].is_leaf ||
          nodes[parent].next != nodes[entry.node].next || (before.planes | entry.planes) != 0 ||
          !(before.is_sampled || entry.is_sampled))
        continue;
      cut_.pop_back();
      cut_.back() = CutNode::unknown(parent);
      part.query_now();
      was_joined = is_any_joined = true;
    }
    part.count = static_cast<std::uint32_t>(cut_.size()) - part.begin;
  }
  if (is_any_joined) levels_.note_divided();
  return is_any_joined;
}

// Replaces pairs of halves that are far beyond the band by their parents. After a shell has moved past many obstacles,
// its cut has many small far nodes. They need no queries, but they occupy entries that near nodes may need.
void ShellCandidates::join_far() noexcept {
  const auto& nodes = shell_->nodes;
  std::size_t size = 0;
  for (CutPart& part : parts_) {
    const std::size_t begin = size;
    const auto far_at_m = static_cast<float>(part.moved_m + band_m_ + kSearch.join_beyond_m);
    for (std::size_t i = part.begin; i < part.begin + part.count; ++i) {
      CutNode entry = old_cut_[i];
      while (size > begin && entry.node != part.node && entry.planes == 0 && entry.query_again_at_m > far_at_m) {
        const CutNode& before = old_cut_[size - 1];
        if (before.planes != 0 || !(before.query_again_at_m > far_at_m)) break;
        const std::uint32_t parent = before.node - 1;
        if (nodes[before.node].next != entry.node || nodes[parent].is_leaf ||
            nodes[parent].next != nodes[entry.node].next)
          break;
        entry = {.node = parent,
                 .query_again_at_m = std::min(before.query_again_at_m, entry.query_again_at_m),
                 .is_sampled = before.is_sampled || entry.is_sampled};
        --size;
      }
      old_cut_[size++] = entry;
    }
    part.begin = static_cast<std::uint32_t>(begin);
    part.count = static_cast<std::uint32_t>(size - begin);
  }
  old_cut_.resize(size);
}

// Stores the current cut and level, so that restore_cut() can restore them. Returns false if the cut is too large.
bool ShellCandidates::keep_cut() noexcept {
  if (cut_.size() > kept_.cut.capacity()) return false;
  kept_.levels = levels_;
  kept_.parts = parts_;
  kept_.cut = cut_;
  kept_.contacts = list_.contacts();
  return true;
}

void ShellCandidates::restore_cut() noexcept {
  parts_ = kept_.parts;
  cut_ = kept_.cut;
  list_.restore_contacts(kept_.contacts);
  levels_.restore(kept_.levels, has_sampled());
}

// Completes the cut after a walk has stopped: copies the old entries of the part in which it stopped, and of all later
// parts.
void ShellCandidates::keep_rest(std::size_t part) noexcept {
  cut_.resize(part == 0 ? 0 : parts_[part - 1].begin + parts_[part - 1].count);
  for (; part < parts_.size(); ++part) {
    const auto entries = std::span(old_cut_).subspan(parts_[part].begin, parts_[part].count);
    if (cut_.size() + entries.size() > cut_limit()) return begin_cut();
    parts_[part].begin = static_cast<std::uint32_t>(cut_.size());
    cut_.insert(cut_.end(), entries.begin(), entries.end());
  }
}

}  // namespace tandem::contact
