#include "common/contact/shell_candidates.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace tandem {
namespace {

// What comes within the band is looked for this much farther out, so that not every step opens something.
constexpr double kAheadMin_m = 1e-4;
constexpr double kAheadMax_m = 1e-3;
constexpr double kStepsAhead = 2;
// A part that has travelled so far may be walked anew, one each step: its points have been asked one by one since, where
// a leaf would do. It must be when travel would take the resolution from distances in single precision.
constexpr double kRenew_m = 5e-4;
constexpr double kRenewAlways_m = 0.05;
// Candidates that are kept for each that may be near: most wait farther out.
constexpr std::size_t kKeptPerNear = 6;
// A coarse list holds while nothing has moved farther.
constexpr double kCoarseSlack_m = 2e-4;
// Of a capacity, what a list must shrink to before it is fine again: no flicker between fine and coarse.
constexpr double kFineAgain = 0.8;
// Weight of depth against error of force in choosing what to refine; between 0.03 and 0.3 it changes little.
constexpr double kDepthMatters = 0.1;
// More than any gain: goes first.
constexpr double kDeepestFirst_m = 1;
// Parts of a shell: their balls are small, so that they move little when the shape turns.
constexpr std::size_t kParts = 64;
// Points of a leaf act as one where their distances differ by no more than this (a few quanta of a distance grid)…
constexpr double kFlat_m = 1e-6;
// …or this part of the gap: what is merged will be apart again before it touches, or off by that part of a step's way…
constexpr double kFlatGap = 0.5;
// …or this part of the depth, but at most so much. Force is linear in depth, so that the mean has the sum of their
// forces; their moment about the mean is lost.
constexpr double kFlatDepth = 0.1;
constexpr double kFlatDepthMax_m = 1e-5;
// How far a leaf may slide until all of its points are asked again: an edge of the other shape may have come under it by
// then, but by less than half of what points resolve.
constexpr double kFlatSlide_m = 2e-4;
// Room for rounding: candidates keep distances in single precision.
constexpr double kRounding_m = 1e-7;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

ContactWork& ContactWork::operator+=(const ContactWork& other) {
  nodes += other.nodes;
  points += other.points;
  is_coarse = is_coarse || other.is_coarse;
  is_refreshed = is_refreshed || other.is_refreshed;
  return *this;
}

ShellCandidates::ShellCandidates(std::uint32_t capacity) : capacity_(capacity) {
  parts_.reserve(kParts);
  candidates_.reserve(kKeptPerNear * capacity + kParts);
  cut_.reserve(std::max<std::size_t>(capacity, kParts) + 2);
}

void ShellCandidates::bind(const PointShell* shell, const BoundingBall& points, const DistanceField* field,
                           const BoundingBall& solid, std::uint32_t capacity) noexcept {
  shell_ = shell;
  field_ = field;
  points_ = points;
  solid_ = solid;
  capacity_ = std::min<std::uint32_t>(capacity, static_cast<std::uint32_t>(cut_.capacity()) - 2);
  margin_m_ = 2 * field->error_m() + kRounding_m;
  candidates_.clear();
  is_coarse_ = false;
  merges_outside_ = false;
  gap_m_ = -1;
  divide(kParts);
}

// Cuts the tree into subtrees, the largest first.
void ShellCandidates::divide(std::size_t parts) noexcept {
  const auto largest_last = [](const Cut& a, const Cut& b) { return a.gain_m < b.gain_m; };
  parts_.clear();
  cut_.clear();
  if (shell_ == nullptr || shell_->nodes.empty()) return;
  const auto& nodes = shell_->nodes;
  cut_.push_back({nodes[0].radius_m, 0});
  while (cut_.size() < parts) {
    const Cut largest = cut_.front();
    const ShellNode& node = nodes[largest.node];
    std::size_t children = 0;
    for (std::uint32_t i = largest.node + 1; i < node.next; i = nodes[i].next) ++children;
    if (node.is_leaf || cut_.size() + children > parts + 1) break;
    std::pop_heap(cut_.begin(), cut_.end(), largest_last);
    cut_.pop_back();
    for (std::uint32_t i = largest.node + 1; i < node.next; i = nodes[i].next) {
      cut_.push_back({nodes[i].radius_m, i});
      std::push_heap(cut_.begin(), cut_.end(), largest_last);
    }
  }
  std::sort(cut_.begin(), cut_.end(), [](const Cut& a, const Cut& b) { return a.node < b.node; });
  for (const Cut& cut : cut_) parts_.emplace_back().node = cut.node;
}

ContactWork ShellCandidates::refresh(const Pose& X_FP, double band_m) noexcept {
  work_ = {};
  if (parts_.empty() || is_out_of_reach(X_FP, band_m)) return work_;
  step_m_ = travel(X_FP);
  if (is_coarse_ && parts_[0].travel_m + band_m > reach_m_) {
    walk_coarse(band_m);
    if (fine_count_ < kFineAgain * capacity_) {
      is_coarse_ = false;
      points_in_band_ = capacity_;
      divide(kParts);
    }
  }
  if (merges_outside_ && !is_coarse_ && points_in_band_ < kFineAgain * capacity_) {
    merges_outside_ = false;
    for (ShellPart& part : parts_) begin_walk(part);
  }
  if (!is_coarse_ && !update_all(band_m) && !merge_outside(band_m)) coarsen(band_m);
  remember_gap();
  work_.is_coarse = is_coarse_ || merges_outside_;
  return work_;
}

ContactWork ShellCandidates::shorten(double band_m) noexcept {
  work_ = {};
  if (is_coarse_ || (!renew_all(band_m) && !merge_outside(band_m))) coarsen(band_m);
  remember_gap();
  work_.is_coarse = is_coarse_ || merges_outside_;
  return work_;
}

void ShellCandidates::coarsen(double band_m) noexcept {
  divide(1);
  is_coarse_ = true;
  merges_outside_ = true;
  walk_coarse(band_m);
}

// Far apart, one look at the poses is enough.
bool ShellCandidates::is_out_of_reach(const Pose& X_FP, double band_m) const noexcept {
  if (gap_m_ < 0) return false;
  const double chord = 2 * (X_FP_.q.conjugate() * X_FP.q).vec().norm();
  const double motion = (X_FP * points_.centre_S - X_FP_ * points_.centre_S).norm() + chord * points_.radius_m;
  return motion + band_m + margin_m_ <= gap_m_;
}

void ShellCandidates::remember_gap() noexcept {
  gap_m_ = is_coarse_ ? reach_m_ - parts_[0].travel_m : kInfinity;
  for (const ShellPart& part : parts_) gap_m_ = std::min(gap_m_, part.due_m - part.travel_m);
}

// Seen from the field, the points moved; seen from the points, the solid did. Distances change by the smaller of both:
// a small tool may turn above a large table. Returns the largest motion of a part.
double ShellCandidates::travel(const Pose& X_FP) noexcept {
  const Eigen::Matrix3d R_before = R_FP_;
  const Eigen::Matrix3d R_now = X_FP.q.toRotationMatrix();
  const Eigen::Matrix3d turn = R_now - R_before;
  const Vec3 shift = X_FP.p - X_FP_.p;
  const double chord = 2 * (X_FP_.q.conjugate() * X_FP.q).vec().norm();
  const Vec3 solid_before = R_before.transpose() * (solid_.centre_S - X_FP_.p);
  const Vec3 solid_now = R_now.transpose() * (solid_.centre_S - X_FP.p);
  const double of_solid = (solid_now - solid_before).norm() + chord * solid_.radius_m;
  double largest = 0;
  for (ShellPart& part : parts_) {
    const ShellNode& node = shell_->nodes[part.node];
    const double of_points = (turn * node.centre_S.cast<double>() + shift).norm() + chord * node.radius_m;
    const double motion = std::min(of_points, of_solid);
    part.travel_m += motion;
    largest = std::max(largest, motion);
  }
  X_FP_ = X_FP;
  R_FP_ = R_now;
  return largest;
}

// False: that was done before, or there are more than fit even so.
bool ShellCandidates::merge_outside(double band_m) noexcept {
  if (merges_outside_) return false;
  merges_outside_ = true;
  points_in_band_ = std::numeric_limits<std::size_t>::max();
  for (ShellPart& part : parts_) begin_walk(part);
  return update_all(band_m);
}

bool ShellCandidates::is_flat(double nearest_m, double farthest_m) const {
  if (merges_outside_ && nearest_m > 0) return true;
  const double of_gap = kFlatGap * std::max(0.0, nearest_m);
  const double of_depth = std::min(kFlatDepthMax_m, kFlatDepth * std::max(0.0, -farthest_m));
  return farthest_m - nearest_m <= kFlat_m + of_gap + of_depth;
}

// False: there are more than fit.
bool ShellCandidates::update_all(double band_m) noexcept {
  renew_one(band_m);
  return std::all_of(parts_.begin(), parts_.end(), [&](ShellPart& part) { return update(part, band_m); });
}

// The part that has most need of it, if one has.
void ShellCandidates::renew_one(double band_m) noexcept {
  ShellPart* oldest = nullptr;
  double oldest_m = kRenew_m;
  for (ShellPart& part : parts_) {
    const bool is_near = part.due_m <= reach_m(part, band_m) || part.travel_m > kRenewAlways_m;
    if (!part.is_walked || !is_near || part.travel_m <= oldest_m) continue;
    oldest = &part;
    oldest_m = part.travel_m;
  }
  if (oldest != nullptr) begin_walk(*oldest);
}

// False: nothing was out of date, or there are more than fit.
bool ShellCandidates::renew_all(double band_m) noexcept {
  bool is_old = false;
  for (ShellPart& part : parts_) {
    if (part.travel_m <= kAheadMin_m || part.due_m > reach_m(part, band_m)) continue;
    is_old = true;
    begin_walk(part);
  }
  return is_old && update_all(band_m);
}

bool ShellCandidates::update(ShellPart& part, double band_m) noexcept {
  if (part.is_walked && part.open_m > reach_m(part, band_m) && part.check_m > part.travel_m) return true;
  work_.is_refreshed = true;
  if (rebuild(part, band_m)) return true;
  compact();
  return rebuild(part, band_m);
}

void ShellCandidates::begin_walk(ShellPart& part) noexcept {
  part.is_walked = false;
  part.begin = part.count = 0;
  part.travel_m = 0;
}

// Puts the part's candidates once more at the end, those opened that must be. False: it did not fit, and is as before.
bool ShellCandidates::rebuild(ShellPart& part, double band_m) noexcept {
  const ShellPart before = part;
  const std::size_t begin = candidates_.size();
  part.due_m = part.open_m = part.check_m = kInfinity;
  is_full_ = false;
  if (part.is_walked) {
    for (std::uint32_t i = 0; i < before.count && !is_full_; ++i) replace(part, candidates_[before.begin + i], band_m);
  } else {
    open(part, part.node, band_m);
  }
  if (is_full_) {
    candidates_.resize(begin);
    part = before;
    return false;
  }
  part.is_walked = true;
  part.begin = static_cast<std::uint32_t>(begin);
  part.count = static_cast<std::uint32_t>(candidates_.size() - begin);
  return true;
}

// Drops what parts have left behind.
void ShellCandidates::compact() noexcept {
  std::array<ShellPart*, kParts + 1> by_begin;
  const auto end = std::transform(parts_.begin(), parts_.end(), by_begin.begin(), [](ShellPart& part) { return &part; });
  std::sort(by_begin.begin(), end, [](const ShellPart* a, const ShellPart* b) { return a->begin < b->begin; });
  std::uint32_t size = 0;
  for (auto part = by_begin.begin(); part != end; ++part) {
    const auto from = candidates_.begin() + (*part)->begin;
    std::copy(from, from + (*part)->count, candidates_.begin() + size);
    (*part)->begin = size;
    size += (*part)->count;
  }
  candidates_.resize(size);
}

void ShellCandidates::replace(ShellPart& part, const ShellCandidate& old, double band_m) noexcept {
  const bool is_near = old.nearest_m <= reach_m(part, band_m);
  if (is_near && old.kind == ShellCandidate::Kind::kUnopened) {
    open(part, old.node, band_m);
  } else if (is_near && old.kind == ShellCandidate::Kind::kFlatLeaf && old.whole_m < part.travel_m) {
    open_leaf(part, old.node);
  } else {
    put(part, old);
    if (old.kind == ShellCandidate::Kind::kUnopened) part.open_m = std::min<double>(part.open_m, old.nearest_m);
    if (old.kind == ShellCandidate::Kind::kFlatLeaf) {
      const double near_at_m = old.nearest_m - band_m - margin_m_;
      part.check_m = std::min(part.check_m, std::max<double>(near_at_m, old.whole_m));
    }
  }
}

void ShellCandidates::put(ShellPart& part, const ShellCandidate& candidate) noexcept {
  if (candidates_.size() == candidates_.capacity()) {
    is_full_ = true;
    return;
  }
  candidates_.push_back(candidate);
  part.due_m = std::min<double>(part.due_m, candidate.nearest_m);
}

// What is below a node: down to the points where it is near, as few nodes as possible elsewhere.
void ShellCandidates::open(ShellPart& part, std::uint32_t root, double band_m) noexcept {
  const double open_m = band_m + margin_m_ + std::clamp(kStepsAhead * step_m_, kAheadMin_m, kAheadMax_m);
  const auto& nodes = shell_->nodes;
  const std::uint32_t end = nodes[root].next;
  for (std::uint32_t i = root; i < end && !is_full_;) {
    const ShellNode& node = nodes[i];
    ++work_.nodes;
    const double nearest_m = distance_at(node.centre_S) - node.radius_m;
    if (nearest_m > open_m) {
      const auto nearest = static_cast<float>(nearest_m + part.travel_m);
      put(part, {node.centre_S, 0, nearest, 0, node.first, node.count, i, ShellCandidate::Kind::kUnopened});
      part.open_m = std::min<double>(part.open_m, nearest);
      i = node.next;
    } else if (node.is_leaf) {
      open_leaf(part, i);
      i = node.next;
    } else {
      ++i;
    }
  }
}

void ShellCandidates::open_leaf(ShellPart& part, std::uint32_t index) noexcept {
  const ShellNode& node = shell_->nodes[index];
  const Leaf leaf = ask(node);
  if (node.count > 1 && is_flat(leaf.nearest_m, leaf.farthest_m)) {
    const bool is_level = leaf.farthest_m - leaf.nearest_m <= kFlat_m;
    const double way_m = is_level ? kFlatSlide_m : std::min(kFlatSlide_m, kFlatGap * std::abs(leaf.nearest_m));
    const auto nearest_m = static_cast<float>(leaf.nearest_m + part.travel_m);
    const auto whole_m = static_cast<float>(part.travel_m + way_m);
    put(part, {node.mean.p_S, node.mean.area_m2, nearest_m, whole_m, node.first, node.count, index,
               ShellCandidate::Kind::kFlatLeaf});
    part.check_m = std::min<double>(part.check_m, whole_m);
    return;
  }
  for (std::uint32_t i = 0; i < node.count; ++i) {
    const ShellPoint& point = shell_->points[node.first + i];
    const auto nearest_m = static_cast<float>(leaf.distances_m[i] + part.travel_m);
    put(part, {point.p_S, point.area_m2, nearest_m, 0, node.first + i, 1, index, ShellCandidate::Kind::kPoints});
  }
}

ShellCandidates::Leaf ShellCandidates::ask(const ShellNode& node) noexcept {
  Leaf leaf{{}, kInfinity, -kInfinity};
  work_.points += node.count;
  for (std::uint32_t i = 0; i < node.count; ++i) {
    const double distance = distance_at(shell_->points[node.first + i].p_S);
    leaf.distances_m[i] = distance;
    leaf.nearest_m = std::min(leaf.nearest_m, distance);
    leaf.farthest_m = std::max(leaf.farthest_m, distance);
  }
  return leaf;
}

void ShellCandidates::walk_coarse(double band_m) noexcept {
  work_.is_refreshed = true;
  ShellPart& part = parts_[0];
  part.travel_m = 0;
  reach_m_ = kInfinity;
  gather_coarse(band_m + kCoarseSlack_m);
  part.begin = 0;
  part.count = static_cast<std::uint32_t>(candidates_.size());
  part.due_m = kInfinity;
  for (const ShellCandidate& candidate : candidates_) part.due_m = std::min<double>(part.due_m, candidate.nearest_m);
}

double ShellCandidates::distance_at(const Eigen::Vector3f& p_P) const {
  return field_->distance_m(R_FP_ * p_P.cast<double>() + X_FP_.p);
}

// What is not reached limits how far the list reaches: often much farther than was asked for.
bool ShellCandidates::is_reached(double nearest_m, double reach_m) noexcept {
  const double nearest = nearest_m - margin_m_;
  if (nearest <= reach_m) return true;
  reach_m_ = std::min(reach_m_, nearest);
  return false;
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
  const DistanceSample sample = field_->sample(R_FP_ * node.centre_S.cast<double>() + X_FP_.p);
  if (!is_reached(sample.distance_m - node.radius_m, reach_m)) return;
  const Vec3 normal_F = R_FP_ * node.mean.normal_S.cast<double>();
  const double rise = node.radius_m * normal_F.cross(sample.gradient).norm();
  const double depth = -sample.distance_m;
  const double error = depth > rise ? 0 : std::max(0.0, depth + rise);
  const bool has_deepest = deepest_point_ >= node.first && deepest_point_ < node.first + node.count;
  const double first = has_deepest ? kDeepestFirst_m : 0;
  cut_.push_back({static_cast<float>(first + error + kDepthMatters * (depth + node.radius_m)), index});
}

// False, and nothing gathered: its points do not fit into `room`.
bool ShellCandidates::gather_leaf(const ShellNode& node, const Leaf& leaf, double reach_m, std::size_t room) noexcept {
  const std::size_t size_before = candidates_.size();
  for (std::uint32_t i = 0; i < node.count; ++i) {
    const double distance = leaf.distances_m[i];
    if (!is_reached(distance, reach_m)) continue;
    if (candidates_.size() - size_before == room) {
      candidates_.resize(size_before);
      return false;
    }
    const ShellPoint& point = shell_->points[node.first + i];
    candidates_.push_back({point.p_S, point.area_m2, static_cast<float>(distance), 0, node.first + i, 1});
  }
  return true;
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

void ShellCandidates::gather_leaf_coarse(const ShellNode& node, double reach_m, std::size_t used) noexcept {
  if (used + 2 > capacity_) {
    gather_mean(node);
    return;
  }
  const Leaf leaf = ask(node);
  const double fine_m = reach_m - kCoarseSlack_m + margin_m_;
  if (is_flat(leaf.nearest_m, leaf.farthest_m)) {
    fine_count_ += leaf.nearest_m <= fine_m ? 1 : 0;
  } else {
    const auto end = leaf.distances_m.begin() + node.count;
    fine_count_ += static_cast<std::size_t>(
        std::count_if(leaf.distances_m.begin(), end, [fine_m](double distance) { return distance <= fine_m; }));
  }
  const std::size_t for_points = capacity_ / 8;
  if (used >= for_points || !gather_leaf(node, leaf, reach_m, for_points - used)) gather_halves(node, leaf, reach_m);
}

// A leaf that the other surface cuts through, as two: what is inside, and what is near. Force is linear in depth on
// either side, so that the means stand for their points exactly where the other surface is flat.
void ShellCandidates::gather_halves(const ShellNode& node, const Leaf& leaf, double reach_m) noexcept {
  std::array<ShellCandidate, 2> halves;
  for (std::uint32_t i = 0; i < node.count; ++i) {
    const double distance = leaf.distances_m[i];
    if (!is_reached(distance, reach_m)) continue;
    const ShellPoint& point = shell_->points[node.first + i];
    ShellCandidate& half = halves[distance < 0 ? 0 : 1];
    if (half.count == 0) half.first = node.first + i;
    half.p_P += point.area_m2 * point.p_S;
    half.area_m2 += point.area_m2;
    half.count = node.first + i + 1 - half.first;
  }
  for (ShellCandidate& half : halves) {
    if (half.area_m2 <= 0) continue;
    half.p_P /= half.area_m2;
    half.nearest_m = static_cast<float>(distance_at(half.p_P));
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
  fine_count_ += node.count / kShellLeafPoints;
  candidates_.push_back(
      {node.mean.p_S, node.mean.area_m2, static_cast<float>(distance), 0, node.first, node.count});
}

}  // namespace tandem
