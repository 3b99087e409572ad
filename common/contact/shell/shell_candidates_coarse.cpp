// The search where more points are near than a step can bear: points stand for their neighbours.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/contact/contact_shape.hpp"
#include "common/contact/shell_candidates.hpp"

namespace tandem::contact {
namespace {

// Of a capacity, what a list must shrink to before it is fine again: no flicker between fine and coarse.
constexpr double kFineAgain = 0.8;
constexpr std::uint32_t kWalksPerTry = 8;
// Weight of depth against error of force in choosing what to refine; between 0.03 and 0.3 it changes little.
constexpr double kDepthMatters = 0.1;
// More than any gain: goes first.
constexpr double kDeepestFirst_m = 1;

}  // namespace

void ShellCandidates::walk_coarse(const Pose& X_FP, double reach_m) noexcept {
  if (is_coarse_) {
    // Of planes few contacts are made: how many, only a fine walk can tell; now and then it is tried.
    const bool is_tried = has_flat_parts() && ++coarse_walks_ % kWalksPerTry == 0;
    if (!is_tried) {
      walk_whole(X_FP, reach_m);
      if (has_flat_parts() || fine_count_ > kFineAgain * capacity_) return;
    }
    // That count was a lower bound: all may be too many still.
    divide(kParts);
    is_coarse_ = !walk_all(X_FP, reach_m) || (has_flat_parts() && contacts_ > kFineAgain * capacity_);
    if (!is_coarse_) return;
  }
  divide(1);
  is_coarse_ = true;
  walk_whole(X_FP, reach_m);
}

void ShellCandidates::walk_whole(const Pose& X_FP, double reach_m) noexcept {
  candidates_.clear();
  contacts_ = 0;
  begin_walk(parts_[0], X_FP, 0);
  gather_coarse(reach_m);
  contacts_ = candidates_.size();
  end_walk(parts_[0]);
}

// Adds the node to the cut if it is near. Its gain: what its force is wrong by at most when its points are one, as
// depth.
//
// A node that lies wholly inside or outside may be replaced by its mean, for force is linear in depth; one that the
// other surface cuts through may not. A flat node at an angle to the surface, or one around an edge, spans `rise` in
// depth. A little for the depth itself, and what holds the deepest point before all else: that one is never merged.
void ShellCandidates::open_node(std::uint32_t index, double reach_m) noexcept {
  const ShellNode& node = shell_->nodes[index];
  ++work_.nodes;
  const DistanceSample sample = field_->sample(R_FP_ * node.centre_S.cast<double>() + p_FP_);
  if (!is_reached(sample.distance_m - node.radius_m, reach_m)) return;
  const Vec3 normal_F = R_FP_ * node.mean.normal_S.cast<double>();
  const double rise = node.radius_m * normal_F.cross(sample.gradient).norm();
  const double depth = -sample.distance_m;
  const double error = depth > rise ? 0 : std::max(0.0, depth + rise);
  const double first = has_deepest(node) ? kDeepestFirst_m : 0;
  cut_.push_back({static_cast<float>(first + error + kDepthMatters * (depth + node.radius_m)), index});
}

// Refines the cut through the tree where that gains most, until nothing finer fits. Nothing that may be near is left
// out. Points one by one get little of the room: two means do nearly as well for eight of them.
void ShellCandidates::gather_coarse(double reach_m) noexcept {
  const auto best_last = [](const Cut& a, const Cut& b) {
    return a.gain_m != b.gain_m ? a.gain_m < b.gain_m : a.node > b.node;
  };
  candidates_.clear();
  cut_.clear();
  fine_count_ = 0;
  deepest_point_ = find_deepest();
  open_node(0, reach_m);
  while (!cut_.empty()) {
    std::pop_heap(cut_.begin(), cut_.end(), best_last);
    const std::uint32_t index = cut_.back().node;
    cut_.pop_back();
    const ShellNode& node = shell_->nodes[index];
    const std::size_t opened = cut_.size();
    const std::size_t used = candidates_.size() + opened;
    if (node.is_leaf) {
      gather_leaf_coarse(node, reach_m, used);
    } else if (!open_children(index, reach_m, capacity_ - used)) {
      gather_mean(node);
    }
    for (std::size_t size = opened + 1; size <= cut_.size(); ++size) {
      std::push_heap(cut_.begin(), cut_.begin() + static_cast<std::ptrdiff_t>(size), best_last);
    }
  }
  std::sort(candidates_.begin(), candidates_.end(),
            [](const ShellCandidate& a, const ShellCandidate& b) { return a.first < b.first; });
}

// No point inside: one that is not there.
std::uint32_t ShellCandidates::find_deepest() noexcept {
  const auto& nodes = shell_->nodes;
  double deepest = 0;
  auto point = std::numeric_limits<std::uint32_t>::max();
  for (std::uint32_t i = 0; i < nodes.size();) {
    const ShellNode& node = nodes[i];
    ++work_.nodes;
    const bool may_be_deeper = -distance_at(node.centre_S) + node.radius_m > deepest;
    if (may_be_deeper && node.is_leaf) {
      for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
        const double depth = -distance_at(shell_->points[k].p_S);
        if (depth <= deepest) continue;
        deepest = depth;
        point = k;
      }
      work_.points += node.count;
    }
    i = may_be_deeper && !node.is_leaf ? i + 1 : node.next;
  }
  return point;
}

bool ShellCandidates::has_deepest(const ShellNode& node) const {
  return deepest_point_ >= node.first && deepest_point_ < node.first + node.count;
}

void ShellCandidates::gather_leaf_coarse(const ShellNode& node, double reach_m, std::size_t used) noexcept {
  const std::size_t for_points = has_deepest(node) ? capacity_ : capacity_ / 8;
  if (used < for_points && gather_leaf(node, reach_m, for_points - used)) {
    fine_count_ += node.count;
  } else if (used + 2 <= capacity_) {
    gather_halves(node, reach_m);
  } else {
    gather_mean(node);
  }
}

// A leaf that the other surface cuts through, as two: what is inside, and what is near. Force is linear in depth on
// either side, so that the means stand for their points exactly where the other surface is flat.
void ShellCandidates::gather_halves(const ShellNode& leaf, double reach_m) noexcept {
  std::array<ShellCandidate, 2> halves;
  std::array<double, 2> sums{};  // of area × distance
  for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
    const ShellPoint& point = shell_->points[i];
    const double distance = distance_at(point.p_S);
    ++work_.points;
    if (!is_reached(distance, reach_m)) continue;
    ++fine_count_;
    const std::size_t side = distance < 0 ? 0 : 1;
    ShellCandidate& half = halves[side];
    sums[side] += point.area_m2 * distance;
    if (half.count == 0) half.first = i;
    half.p_P += point.area_m2 * point.p_S;
    half.area_m2 += point.area_m2;
    half.count = i + 1 - half.first;
  }
  for (std::size_t side = 0; side < halves.size(); ++side) {
    ShellCandidate& half = halves[side];
    if (half.area_m2 <= 0) continue;
    half.p_P /= half.area_m2;
    // Around something round the mean lies off the surface: moved to where it is as near as its points are. Beyond the
    // band distances are bounds, and nothing is to be made of them.
    const DistanceSample mean = field_->sample(R_FP_ * half.p_P.cast<double>() + p_FP_);
    const bool is_known = std::abs(mean.distance_m) <= field_->band_m();
    const double distance = is_known ? sums[side] / half.area_m2 : distance_at(half.p_P);
    if (is_known) half.p_P += (R_FP_.transpose() * mean.gradient * (distance - mean.distance_m)).cast<float>();
    half.distance_m = static_cast<float>(distance);
    candidates_.push_back(half);
  }
}

// False, and nothing opened: they do not fit into `room`. Leaves the order of the heap to the caller.
bool ShellCandidates::open_children(std::uint32_t parent, double reach_m, std::size_t room) noexcept {
  const std::size_t size_before = cut_.size();
  const auto& nodes = shell_->nodes;
  for (std::uint32_t child = parent + 1; child < nodes[parent].next; child = nodes[child].next) {
    open_node(child, reach_m);
    if (cut_.size() - size_before > room) {
      cut_.resize(size_before);
      return false;
    }
  }
  return true;
}

void ShellCandidates::gather_mean(const ShellNode& node) noexcept {
  const double distance = distance_at(node.mean.p_S);
  ++work_.points;
  fine_count_ += node.count;
  candidates_.push_back({node.mean.p_S, node.mean.area_m2, static_cast<float>(distance), node.first, node.count});
}

}  // namespace tandem::contact
