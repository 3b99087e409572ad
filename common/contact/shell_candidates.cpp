#include "common/contact/shell_candidates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/contact/contact_shape.hpp"

namespace tandem::contact {
namespace {

// Slack is worth its price (more candidates a step) when a walk is avoided often enough. Half or twice these values
// cost a few per cent (measured on two bunnies that slide over each other at 0.01 to 0.5 m/s).
constexpr double kSlackMin_m = 2e-4;
constexpr double kSlackMax_m = 2e-3;
constexpr double kStepsPerWalk = 2;
// Of a capacity, what a list must shrink to before it is fine again: no flicker between fine and coarse.
constexpr double kFineAgain = 0.8;
// Weight of depth against error of force in choosing what to refine; between 0.03 and 0.3 it changes little.
constexpr double kDepthMatters = 0.1;
// More than any gain: goes first.
constexpr double kDeepestFirst_m = 1;
// Parts of a shell: their balls are small, so that they move little when the shape turns.
constexpr std::size_t kParts = 64;
// Points of a leaf whose distances differ by less than this act as one: where flat meets flat, the resolution of
// contact is a leaf (a millimetre or two), and its work a quarter or less. A few quanta of a distance grid.
// Until the next walk the shapes may turn: then each point is off by up to the size of the leaf × that angle.
constexpr double kFlat_m = 1e-6;
// Room for rounding: candidates keep distances in single precision.
constexpr double kRounding_m = 1e-8;

Vec3 middle_of(const ContactShape& shape) {
  return (shape.low_S + shape.high_S) / 2;
}

// About its middle. The surface bulges out of the box around its points by less than the way to the next of them.
double radius_of(const ContactShape& shape) {
  return (shape.high_S - shape.low_S).norm() / 2 + shape.shells.surface.spacing_m;
}

}  // namespace

ContactWork& ContactWork::operator+=(const ContactWork& other) {
  nodes += other.nodes;
  points += other.points;
  is_coarse = is_coarse || other.is_coarse;
  is_refreshed = is_refreshed || other.is_refreshed;
  return *this;
}

/// A node of the cut through the tree, and what refining it gains.
struct ShellCandidates::Cut {
  float gain_m = 0;
  std::uint32_t node = 0;
};

ShellCandidates::ShellCandidates(ShellCandidates&& other) noexcept = default;
ShellCandidates::~ShellCandidates() = default;

ShellCandidates::ShellCandidates(std::uint32_t capacity) : capacity_(capacity) {
  parts_.reserve(kParts);
  candidates_.reserve(capacity + 1);
  old_candidates_.reserve(capacity + 1);
  cut_.reserve(std::max<std::size_t>(capacity, kParts) + 2);
}

void ShellCandidates::bind(const PointShell& shell, const ContactShape& points, const ContactShape& solid,
                           std::uint32_t capacity) noexcept {
  shell_ = &shell;
  field_ = solid.field.get();
  points_centre_P_ = middle_of(points);
  points_radius_m_ = radius_of(points);
  solid_centre_F_ = middle_of(solid);
  solid_radius_m_ = radius_of(solid);
  capacity_ = std::min<std::uint32_t>(capacity, static_cast<std::uint32_t>(candidates_.capacity()) - 1);
  candidates_.clear();
  is_coarse_ = false;
  slack_limit_m_ = kSlackMax_m;
  gap_m_ = -1;
  drift_m_ = 0;
  X_FP_before_ = Pose{};
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
  lever_m_ = 0;
  for (const Cut& cut : cut_) {
    parts_.emplace_back().node = cut.node;
    const Vec3 lever = nodes[cut.node].centre_S.cast<double>() - points_centre_P_;
    lever_m_ = std::max(lever_m_, lever.norm() + nodes[cut.node].radius_m);
  }
}

ContactWork ShellCandidates::refresh(const Pose& X_FP, double band_m) noexcept {
  work_ = {};
  if (parts_.empty() || is_out_of_reach(X_FP, band_m)) return work_;
  R_FP_ = X_FP.q.toRotationMatrix();
  p_FP_ = X_FP.p;
  solid_P_ = R_FP_.transpose() * (solid_centre_F_ - p_FP_);
  add_drift(X_FP);
  bool is_expired = false;
  for (ShellPart& part : parts_) is_expired = has_expired(part, X_FP, band_m) || is_expired;
  if (is_expired) {
    work_.is_refreshed = true;
    if (is_coarse_) {
      walk_coarse(X_FP, band_m + kSlackMin_m);
    } else if (!walk_expired(X_FP, band_m)) {
      // Slack must not make contact coarse: with the least of it, all may still fit.
      slack_limit_m_ = kSlackMin_m;
      if (!walk_all(X_FP, band_m + kSlackMin_m)) walk_coarse(X_FP, band_m + kSlackMin_m);
    }
  }
  remember_gap(X_FP, band_m);
  work_.is_coarse = is_coarse_;
  return work_;
}

// Far apart, one look at the poses is enough.
bool ShellCandidates::is_out_of_reach(const Pose& X_FP, double band_m) noexcept {
  if (gap_m_ < 0) return false;
  const double chord = 2 * (X_FP_gap_.q.conjugate() * X_FP.q).vec().norm();
  const double motion = (X_FP * points_centre_P_ - X_FP_gap_ * points_centre_P_).norm() + chord * points_radius_m_;
  return motion + band_m <= gap_m_;
}

void ShellCandidates::remember_gap(const Pose& X_FP, double band_m) noexcept {
  gap_m_ = -1;
  if (!candidates_.empty()) return;
  gap_m_ = std::numeric_limits<double>::infinity();
  for (ShellPart& part : parts_) {
    if (part.has_old_look) look_at(part, X_FP);
    gap_m_ = std::min(gap_m_, part.reach_m - part.motion_m);
  }
  gap_m_ = std::max(gap_m_, band_m);
  X_FP_gap_ = X_FP;
}

// By how much `of_points` below can have grown since the last refresh, of any part.
void ShellCandidates::add_drift(const Pose& X_FP) noexcept {
  const double chord = 2 * (X_FP_before_.q.conjugate() * X_FP.q).vec().norm();
  drift_m_ += (X_FP * points_centre_P_ - X_FP_before_ * points_centre_P_).norm() + chord * lever_m_;
  X_FP_before_ = X_FP;
}

void ShellCandidates::look_at(ShellPart& part, const Pose& X_FP) const noexcept {
  const ShellNode& node = shell_->nodes[part.node];
  const double chord = 2 * (part.q_FP.conjugate() * X_FP.q).vec().norm();
  // Seen from the field, the points moved; seen from the points, the solid did. Distances change by the smaller of
  // both: a small tool may turn above a large table.
  const Vec3 centre_F = R_FP_ * node.centre_S.cast<double>() + p_FP_;
  const double of_points = (centre_F - part.centre_F).norm() + chord * node.radius_m;
  part.motion_m = std::min(of_points, (solid_P_ - part.solid_P).norm() + chord * solid_radius_m_);
  part.looked_motion_m = of_points;
  part.looked_drift_m = drift_m_;
  part.has_old_look = false;
}

bool ShellCandidates::has_expired(ShellPart& part, const Pose& X_FP, double band_m) const noexcept {
  if (!part.is_walked) return true;
  ++part.steps_since;
  // Most parts are far from contact and have no candidates: nobody asks how far they moved while it is less than they
  // may.
  const double most_m = part.looked_motion_m + (drift_m_ - part.looked_drift_m) + kRounding_m;
  part.has_old_look = part.count == 0 && most_m + band_m <= part.reach_m;
  if (part.has_old_look) return false;
  look_at(part, X_FP);
  return part.motion_m + band_m > part.reach_m;
}

// Faster parts get more slack, so that a walk lasts for some steps.
double ShellCandidates::slack_of(const ShellPart& part) const {
  const double motion_a_step = part.is_walked ? part.motion_m / std::max(1U, part.steps_since) : 0;
  return std::clamp(kStepsPerWalk * motion_a_step, kSlackMin_m, slack_limit_m_);
}

void ShellCandidates::begin_walk(ShellPart& part, const Pose& X_FP) noexcept {
  part.begin = static_cast<std::uint32_t>(candidates_.size());
  part.is_walked = true;
  part.motion_m = 0;
  part.steps_since = 0;
  part.centre_F = R_FP_ * shell_->nodes[part.node].centre_S.cast<double>() + p_FP_;
  part.solid_P = solid_P_;
  part.q_FP = X_FP.q;
  part.looked_motion_m = 0;
  part.looked_drift_m = drift_m_;
  part.has_old_look = false;
  reach_m_ = std::numeric_limits<double>::infinity();
}

void ShellCandidates::end_walk(ShellPart& part) noexcept {
  part.count = static_cast<std::uint32_t>(candidates_.size()) - part.begin;
  part.reach_m = reach_m_;
}

// False: there are more than fit.
bool ShellCandidates::walk_expired(const Pose& X_FP, double band_m) noexcept {
  std::swap(candidates_, old_candidates_);
  candidates_.clear();
  for (ShellPart& part : parts_) {
    if (!part.is_walked || part.motion_m + band_m > part.reach_m) {
      const double slack = slack_of(part);
      begin_walk(part, X_FP);
      if (!gather_all(part.node, band_m + slack)) return false;
      end_walk(part);
    } else {
      if (candidates_.size() + part.count > capacity_) return false;
      const auto from = old_candidates_.begin() + part.begin;
      part.begin = static_cast<std::uint32_t>(candidates_.size());
      candidates_.insert(candidates_.end(), from, from + part.count);
    }
  }
  if (2 * candidates_.size() < capacity_) slack_limit_m_ = std::min(kSlackMax_m, 1.25 * slack_limit_m_);
  return true;
}

bool ShellCandidates::walk_all(const Pose& X_FP, double reach_m) noexcept {
  candidates_.clear();
  for (ShellPart& part : parts_) {
    begin_walk(part, X_FP);
    if (!gather_all(part.node, reach_m)) return false;
    end_walk(part);
  }
  return true;
}

void ShellCandidates::walk_coarse(const Pose& X_FP, double reach_m) noexcept {
  if (is_coarse_) {
    walk_whole(X_FP, reach_m);
    if (fine_count_ > kFineAgain * capacity_) return;
    // That count was a lower bound: all may be too many still.
    divide(kParts);
    is_coarse_ = !walk_all(X_FP, reach_m);
    if (!is_coarse_) return;
  }
  divide(1);
  is_coarse_ = true;
  walk_whole(X_FP, reach_m);
}

void ShellCandidates::walk_whole(const Pose& X_FP, double reach_m) noexcept {
  candidates_.clear();
  begin_walk(parts_[0], X_FP);
  gather_coarse(reach_m);
  end_walk(parts_[0]);
}

double ShellCandidates::distance_at(const Eigen::Vector3f& p_P) const {
  return field_->distance_m(R_FP_ * p_P.cast<double>() + p_FP_);
}

// What is not reached limits how far the list reaches: often much farther than was asked for.
bool ShellCandidates::is_reached(double nearest_m, double reach_m) noexcept {
  const double nearest = nearest_m - 2 * field_->error_m() - kRounding_m;
  if (nearest <= reach_m) return true;
  reach_m_ = std::min(reach_m_, nearest);
  return false;
}

// False: there are more than fit.
bool ShellCandidates::gather_all(std::uint32_t root, double reach_m) noexcept {
  const auto& nodes = shell_->nodes;
  const std::uint32_t end = nodes[root].next;
  for (std::uint32_t i = root; i < end;) {
    const ShellNode& node = nodes[i];
    ++work_.nodes;
    if (!is_reached(distance_at(node.centre_S) - node.radius_m, reach_m)) {
      i = node.next;
    } else if (node.is_leaf) {
      if (!gather_leaf(node, reach_m, capacity_ - candidates_.size())) return false;
      i = node.next;
    } else {
      ++i;
    }
  }
  return true;
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

// False, and nothing gathered: its points do not fit into `room`.
bool ShellCandidates::gather_leaf(const ShellNode& node, double reach_m, std::size_t room) noexcept {
  const std::size_t size_before = candidates_.size();
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
    const ShellPoint& point = shell_->points[i];
    const double distance = distance_at(point.p_S);
    ++work_.points;
    if (!is_reached(distance, reach_m)) continue;
    if (candidates_.size() - size_before == room) {
      candidates_.resize(size_before);
      return false;
    }
    candidates_.push_back({point.p_S, point.area_m2, static_cast<float>(distance), i, 1});
  }
  if (candidates_.size() - size_before == node.count) merge_flat(size_before);
  return true;
}

// What is at equal distance, as one; the mean of what lies around something round is not.
void ShellCandidates::merge_flat(std::size_t begin) noexcept {
  const auto first = candidates_.begin() + static_cast<std::ptrdiff_t>(begin);
  if (candidates_.end() - first < 2) return;
  const auto [low, high] =
      std::minmax_element(first, candidates_.end(),
                          [](const ShellCandidate& a, const ShellCandidate& b) { return a.distance_m < b.distance_m; });
  if (high->distance_m - low->distance_m > kFlat_m) return;
  ShellCandidate mean = *first;
  mean.p_P.setZero();
  mean.area_m2 = 0;
  for (auto candidate = first; candidate != candidates_.end(); ++candidate) {
    mean.p_P += candidate->area_m2 * candidate->p_P;
    mean.area_m2 += candidate->area_m2;
  }
  mean.p_P /= mean.area_m2;
  mean.distance_m = static_cast<float>(distance_at(mean.p_P));
  ++work_.points;
  if (mean.distance_m - high->distance_m > kFlat_m || low->distance_m - mean.distance_m > kFlat_m) return;
  mean.count = candidates_.back().first + 1 - mean.first;
  candidates_.resize(begin);
  candidates_.push_back(mean);
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
