#include "common/contact/shell/candidate_list.hpp"

#include <algorithm>
#include <bit>

namespace tandem::contact {

CandidateList::CandidateList(std::uint32_t capacity) : largest_capacity_(capacity), capacity_(capacity) {
  candidates_.reserve(capacity + kShellLeafPoints);
}

void CandidateList::bind(const PointShell& shell, std::uint32_t capacity) noexcept {
  shell_ = &shell;
  capacity_ = std::max(2U, std::min(capacity, largest_capacity_));
  clear();
}

void CandidateList::clear() noexcept {
  candidates_.clear();
  contacts_ = more_contacts_ = 0;
  near_count_ = 0;
}

bool CandidateList::add(const LeafSamples& leaf, double band_m, bool is_fine, double rigid_depth_m,
                        bool must) noexcept {
  near_count_ += leaf.near_count(band_m);
  const std::size_t before = candidates_.size();
  if (is_fine) {
    leaf.add_points(band_m, candidates_);
  } else {
    leaf.add_joined(band_m, rigid_depth_m, must, candidates_);
  }
  contacts_ += candidates_.size() - before;
  return contacts_ <= capacity_;
}

bool CandidateList::add_planes(std::uint32_t index, PlaneSet planes) noexcept {
  const ShellNode& node = shell_->nodes[index];
  const std::size_t contacts = least_contacts_of(node);
  contacts_ += contacts;
  more_contacts_ += more_contacts_of(index, planes);
  near_count_ += contacts;
  if (contacts_ > capacity_) return false;
  candidates_.push_back({.p_P = node.mean.p_S,
                         .area_m2 = node.mean.area_m2,
                         .first = node.first,
                         .count = node.count,
                         .node = index,
                         .planes = planes});
  return true;
}

bool CandidateList::remove_points_of(std::uint32_t node, bool is_fine) noexcept {
  const auto& nodes = shell_->nodes;
  std::size_t size = candidates_.size(), contacts = 0, more = 0, near = 0;
  for (; size > 0 && candidates_[size - 1].first >= nodes[node].first; --size) {
    const ShellCandidate& old = candidates_[size - 1];
    const std::size_t count = old.planes == 0 ? 1 : least_contacts_of(nodes[old.node]);
    contacts += count;
    more += more_contacts_of(old.node, old.planes);
    near += old.planes != 0 ? count : is_fine ? old.count : 0;
  }
  if (contacts_ - contacts + least_contacts_of(nodes[node]) > capacity_) return false;
  candidates_.resize(size);
  contacts_ -= contacts;
  more_contacts_ -= more;
  near_count_ -= near;
  return true;
}

// Returns the number of additional contacts that a node above several planes needs: one set for each plane after the
// first.
std::size_t CandidateList::more_contacts_of(std::uint32_t node, PlaneSet planes) const {
  const auto count = static_cast<std::size_t>(std::popcount(planes));
  return count < 2 ? 0 : (count - 1) * least_contacts_of(shell_->nodes[node]);
}

}  // namespace tandem::contact
