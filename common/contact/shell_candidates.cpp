#include "common/contact/shell_candidates.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "common/contact/contact_shape.hpp"
#include "common/contact/flat/plane_contacts.hpp"

namespace tandem::contact {
namespace {

// Slack is worth its price (more candidates a step) when a walk is avoided often enough. Half or twice these values
// cost a few per cent (measured on two bunnies that slide over each other at 0.01 to 0.5 m/s).
constexpr double kSlackMin_m = 2e-4;
constexpr double kSlackMax_m = 2e-3;
constexpr double kStepsPerWalk = 2;
// Nodes above planes need no slack to be cheap: a walk finds them again soon.
constexpr double kPlaneSlack_m = 3e-4;
// How far to the side points may go while part and field move by 1 against each other. Motion is measured at the solid's
// own ball, points near it may be a little outside; of a tiny solid that would be much.
constexpr double kSideways = 1.5;
constexpr double kMinSolid_m = 5e-3;
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
  contacts_ = 0;
  is_coarse_ = false;
  coarse_walks_ = 0;
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
  return is_due(part, band_m);
}

bool ShellCandidates::is_due(const ShellPart& part, double band_m) {
  return !part.is_walked || part.motion_m + band_m > part.reach_m || part.motion_m > part.plane_motion_m;
}

// Faster parts get more slack, so that a walk lasts for some steps.
double ShellCandidates::slack_of(const ShellPart& part) const {
  const double motion_a_step = part.is_walked ? part.motion_m / std::max(1U, part.steps_since) : 0;
  return std::clamp(kStepsPerWalk * motion_a_step, kSlackMin_m, slack_limit_m_);
}

void ShellCandidates::begin_walk(ShellPart& part, const Pose& X_FP, double slack_m) noexcept {
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
  part.plane_motion_m = std::min(slack_m, kPlaneSlack_m);
  plane_motion_m_ = part.plane_motion_m;
  contacts_before_ = contacts_;
  has_planes_ = false;
  reach_m_ = std::numeric_limits<double>::infinity();
}

void ShellCandidates::end_walk(ShellPart& part) noexcept {
  part.count = static_cast<std::uint32_t>(candidates_.size()) - part.begin;
  part.reach_m = reach_m_;
  part.contacts = contacts_ - contacts_before_;
  if (!has_planes_) part.plane_motion_m = std::numeric_limits<double>::infinity();
}

// False: there are more than fit.
bool ShellCandidates::walk_expired(const Pose& X_FP, double band_m) noexcept {
  std::swap(candidates_, old_candidates_);
  candidates_.clear();
  contacts_ = 0;
  for (ShellPart& part : parts_) {
    if (is_due(part, band_m)) {
      const double slack = slack_of(part);
      begin_walk(part, X_FP, slack);
      if (!gather_all(part.node, band_m + slack)) return false;
      end_walk(part);
    } else {
      if (!has_room(part.contacts)) return false;
      contacts_ += part.contacts;
      const auto from = old_candidates_.begin() + part.begin;
      part.begin = static_cast<std::uint32_t>(candidates_.size());
      candidates_.insert(candidates_.end(), from, from + part.count);
    }
  }
  if (2 * contacts_ < capacity_) slack_limit_m_ = std::min(kSlackMax_m, 1.25 * slack_limit_m_);
  return true;
}

bool ShellCandidates::walk_all(const Pose& X_FP, double reach_m) noexcept {
  candidates_.clear();
  contacts_ = 0;
  for (ShellPart& part : parts_) {
    begin_walk(part, X_FP, kSlackMin_m);
    if (!gather_all(part.node, reach_m)) return false;
    end_walk(part);
  }
  return true;
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
    } else if (const PlaneSet planes = planes_below(node)) {
      if (!gather_planes(i, planes, reach_m)) return false;
      i = node.next;
    } else if (node.is_leaf) {
      const std::size_t size_before = candidates_.size();
      if (!gather_leaf(node, reach_m, capacity_ - contacts_)) return false;
      contacts_ += candidates_.size() - size_before;
      i = node.next;
    } else {
      ++i;
    }
  }
  return true;
}

// For all places that the node may go to until its part is walked again.
PlaneSet ShellCandidates::planes_below(const ShellNode& node) const noexcept {
  if (node.flat == ShellNode::kNotFlat || solid_radius_m_ < kMinSolid_m) return 0;
  OrientedBox box_F = shell_->flat_nodes[node.flat].box_S().moved(R_FP_, p_FP_);
  // How far the shapes move is measured at the solid: what is farther out may move more.
  if ((box_F.centre - solid_centre_F_).norm() + box_F.half_m.norm() > kSideways * solid_radius_m_) return 0;
  box_F.half_m.array() += kSideways * plane_motion_m_;
  return largest_over(field_->planes(), field_->planes_over(box_F), box_F);
}

// False: there is no room.
bool ShellCandidates::gather_planes(std::uint32_t index, PlaneSet planes, double reach_m) noexcept {
  const ShellNode& node = shell_->nodes[index];
  const OrientedBox box_F = shell_->flat_nodes[node.flat].box_S().moved(R_FP_, p_FP_);
  double nearest = -std::numeric_limits<double>::infinity();
  for (PlaneSet rest = planes; rest != 0; rest &= rest - 1) {
    const FieldPlane& plane_F = field_->planes()[static_cast<std::size_t>(std::countr_zero(rest))];
    nearest = std::max(nearest, plane_F.distance_m(box_F.centre) - box_F.reach_m(plane_F.normal));
  }
  if (!is_reached(nearest, reach_m)) return true;
  const std::size_t contacts = contacts_of_node(node, static_cast<std::size_t>(std::popcount(planes)));
  if (!has_room(contacts)) return false;
  contacts_ += contacts;
  has_planes_ = true;
  candidates_.push_back(
      {node.mean.p_S, node.mean.area_m2, static_cast<float>(nearest), node.first, node.count, index, planes});
  return true;
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

}  // namespace tandem::contact
