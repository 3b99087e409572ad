#include "common/contact/shell_candidates.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "common/contact/contact_shape.hpp"
#include "common/contact/flat/plane_contacts.hpp"

namespace tandem::contact {
namespace {

// Two nodes are one again when they may go so far before they must be asked.
constexpr double kJoinAt_m = 3e-4;
// Until where motion is added up, since the cut keeps distances in single precision.
constexpr double kFarthest_m = 0.25;
// So many times the looks that a step may take can be too many for one only; a cut that begins needs more, the first most.
constexpr std::uint32_t kWalkLooks = 6, kNewCutLooks = 8, kFirstCutLooks = 16;
// A part is looked over after this much motion, some of them earlier and one a step: small nodes next to a groove that was
// passed by may be one large one above planes again. Where nothing came of it, after twice as much.
constexpr double kLookOver_m = 4e-3, kMaxLookOver_m = 16e-3;

// Nodes above planes are looked for again after this much motion, some of them earlier: not all in one step.
constexpr double kPlaneMotion_m = 2e-4;
// A node that is not above planes is asked again after so much motion at most, or half of it.
constexpr double kNoPlanes_m = 6e-4;
// How far to the side points may go while part and field move by 1 against each other. Motion is measured at the solid's
// own ball, points near it may be a little outside; of a tiny solid that would be much.
constexpr double kSideways = 1.5;
constexpr double kMinSolid_m = 5e-3;
// So many nodes a step are newly asked for planes, and where a cut begins: a grid needs microseconds to answer.
constexpr std::uint32_t kMaxQuestions = 8, kMaxFirstQuestions = 512;

// About its middle. The surface bulges out of the box around its points by less than the way to the next of them.
double radius_of(const ContactShape& shape) {
  return (shape.high_S - shape.low_S).norm() / 2 + shape.shells.surface.spacing_m;
}

double chord(const Quat& a, const Quat& b) {
  return 2 * (a.conjugate() * b).vec().norm();
}

/// Less by as much as rounding could make it more.
float rounded_down(double a) {
  constexpr double kFar = 100;
  const double least = std::min(a, kFar);
  return static_cast<float>(least - std::numeric_limits<float>::epsilon() * std::abs(least));
}

/// 0.5 to 1, of each node another.
double share_of(std::uint32_t node) {
  return 0.5 + 0x1.0p-33 * (node * 2654435769U);
}

}  // namespace

/// A node of the cut.
struct ShellCandidates::CutNode {
  std::uint32_t node = 0;
  float asked_again_at_m = 0;  ///< when its part has gone that far, and the band is added
  PlaneSet planes = 0;         ///< it is above these, until then; without the band
  LeafLags lags = {};          ///< of a leaf's points that were asked: how much later each of them is asked again
  bool is_leaf = false;        ///< whose points were asked
  bool is_known(double gone_m, double band_m) const { return gone_m + (planes != 0 ? 0 : band_m) < asked_again_at_m; }
};

/// A part of the shell, and its piece of the cut: small, so that it moves little when the shape turns.
struct ShellCandidates::Part {
  std::uint32_t node = 0;  ///< the root of its tree
  std::uint32_t begin = 0, count = 0;
  double gone_m = 0;               ///< a sum over steps: none of its points has come nearer by more
  double asked_again_at_m = 0;     ///< the least of its nodes'
  double looked_over_at_m = 0;     ///< whether halves in it are one above planes again
  double looked_over_after_m = 0;  ///< and after so much motion the next time
  bool has_open_question = false;  ///< whether some node of it is above planes: its cut begins anew
};

/// What a level found, as in the members that keep_found() names.
struct ShellCandidates::Found {
  std::tuple<int, std::vector<Part>, std::vector<CutNode>, std::vector<ShellCandidate>, std::size_t, std::size_t,
             std::uint32_t, std::uint32_t, std::uint32_t>
      all;
};

ShellCandidates::ShellCandidates(ShellCandidates&& other) noexcept = default;
ShellCandidates::~ShellCandidates() = default;

ShellCandidates::ShellCandidates(std::uint32_t capacity)
    : largest_capacity_(capacity), capacity_(capacity), before_(std::make_unique<Found>()) {
  for (auto* parts : {&parts_, &std::get<std::vector<Part>>(before_->all)}) parts->reserve(kParts + 1);
  for (auto* candidates : {&candidates_, &std::get<std::vector<ShellCandidate>>(before_->all)})
    candidates->reserve(capacity + kShellLeafPoints);
  std::get<std::vector<CutNode>>(before_->all).reserve(cut_limit() / 2);  // finer levels are tried where there is room
  cut_.reserve(cut_limit());
  old_cut_.reserve(cut_limit());
  answers_.resize(kAnswers);
}

void ShellCandidates::bind(const PointShell& shell, const ContactShape& points, const ContactShape& solid,
                           std::uint32_t capacity) noexcept {
  shell_ = &shell;
  field_ = solid.field.get();
  points_centre_P_ = (points.low_S + points.high_S) / 2;
  points_radius_m_ = radius_of(points);
  solid_centre_F_ = (solid.low_S + solid.high_S) / 2;
  solid_radius_m_ = radius_of(solid);
  rigid_depth_m_ = std::min(points.rigid_depth_m, solid.rigid_depth_m);
  capacity_ = std::max(2U, std::min(capacity, largest_capacity_));
  candidates_.clear();
  contacts_ = 0;
  gap_m_ = -1;
  has_walked_ = false;
  least_band_m_ = std::numeric_limits<double>::infinity();
  steps_to_try_ = 0;
  steps_per_try_ = kStepsPerTry;
  dense_steps_ = 0;
  is_try_ = false;
  // At the coarsest level a part is two candidates.
  divide(std::clamp<std::size_t>(capacity_ / 4, 1, kParts));
  std::ranges::fill(answers_, CutNode{});
  std::uint32_t most_points = 0;
  for (const Part& part : parts_) most_points = std::max(most_points, shell_->nodes[part.node].count);
  for (level_ = 0; leaf_points(0) < most_points;) ++level_;
  coarsest_level_ = level_;
  change_level(kFine);
}

// Cuts the tree into subtrees, the largest first.
void ShellCandidates::divide(std::size_t parts) noexcept {
  parts_.clear();
  if (shell_ == nullptr || shell_->nodes.empty()) return;
  const auto& nodes = shell_->nodes;
  const auto largest_last = [&](const Part& a, const Part& b) {
    return nodes[a.node].radius_m < nodes[b.node].radius_m;
  };
  parts_.push_back({.node = 0});
  while (parts_.size() < parts) {
    const std::uint32_t largest = parts_.front().node;
    const ShellNode& node = nodes[largest];
    std::size_t children = 0;
    for (std::uint32_t i = largest + 1; i < node.next; i = nodes[i].next) ++children;
    if (node.is_leaf || parts_.size() + children > parts + 1) break;
    std::pop_heap(parts_.begin(), parts_.end(), largest_last);
    parts_.pop_back();
    for (std::uint32_t i = largest + 1; i < node.next; i = nodes[i].next) {
      parts_.push_back({.node = i});
      std::push_heap(parts_.begin(), parts_.end(), largest_last);
    }
  }
  std::sort(parts_.begin(), parts_.end(), [](const Part& a, const Part& b) { return a.node < b.node; });
}

// Of which nothing is known.
void ShellCandidates::begin_cut() noexcept {
  cut_.clear();
  for (Part& part : parts_) {
    part.begin = static_cast<std::uint32_t>(cut_.size());
    part.count = 1;
    part.asked_again_at_m = -std::numeric_limits<double>::infinity();
    part.looked_over_after_m = kLookOver_m;
    part.looked_over_at_m = part.gone_m + share_of(part.node) * kLookOver_m;
    part.has_open_question = false;
    cut_.push_back({.node = part.node, .asked_again_at_m = -std::numeric_limits<float>::infinity()});
  }
}

void ShellCandidates::change_level(int level) noexcept {
  level_ = level;
  is_try_ = false;
  steps_at_level_ = 0;
  dense_steps_ = 0;
  begin_cut();
}

// False: it is too much.
bool ShellCandidates::keep_found() noexcept {
  if (cut_.size() > std::get<std::vector<CutNode>>(before_->all).capacity()) return false;
  before_->all =
      std::tie(level_, parts_, cut_, candidates_, contacts_, near_count_, walk_points_, steps_at_level_, dense_steps_);
  return true;
}

void ShellCandidates::take_back_found() noexcept {
  change_level(std::get<int>(before_->all));
  std::tie(level_, parts_, cut_, candidates_, contacts_, near_count_, walk_points_, steps_at_level_, dense_steps_) =
      before_->all;
}

// Far apart, one look at the poses is enough.
bool ShellCandidates::is_out_of_reach(const Pose& X_FP, double band_m) noexcept {
  if (gap_m_ < 0) return false;
  const double motion =
      (X_FP * points_centre_P_ - X_FP_gap_ * points_centre_P_).norm() + chord(X_FP_gap_.q, X_FP.q) * points_radius_m_;
  return motion + band_m <= gap_m_;
}

void ShellCandidates::remember_gap(const Pose& X_FP) noexcept {
  gap_m_ = -1;
  // Of a larger node not all points are known.
  if (!candidates_.empty() || level_ > 0) return;
  gap_m_ = std::numeric_limits<double>::infinity();
  for (const Part& part : parts_) gap_m_ = std::min(gap_m_, part.asked_again_at_m - part.gone_m);
  X_FP_gap_ = X_FP;
}

// What is known of points is said for the least band: for a lesser one, steep fields may have come nearer than that.
void ShellCandidates::allow_band(double band_m) noexcept {
  band_m_ = band_m;
  if (band_m >= least_band_m_) return;
  if (std::isfinite(least_band_m_)) {
    for (Part& part : parts_) part.gone_m += (1 - 1 / kSteepest) * (least_band_m_ - band_m);
  }
  least_band_m_ = band_m;
}

// Seen from the field, the points moved; seen from the points, the solid did. Distances change by the smaller of both: a
// small tool may turn above a large table.
void ShellCandidates::move(const Pose& X_FP) noexcept {
  const Eigen::Matrix3d R_before = R_FP_;
  const Vec3 p_before = p_FP_;
  R_FP_ = X_FP.q.toRotationMatrix();
  p_FP_ = X_FP.p;
  const double turned = chord(X_FP_before_.q, X_FP.q);
  X_FP_before_ = X_FP;
  if (!has_walked_) return;
  const Vec3 solid_P = R_FP_.transpose() * (solid_centre_F_ - p_FP_);
  const Vec3 solid_before_P = R_before.transpose() * (solid_centre_F_ - p_before);
  const double of_solid = (solid_P - solid_before_P).norm() + turned * solid_radius_m_;
  const Eigen::Matrix3d turn = R_FP_ - R_before;
  const Vec3 shift = p_FP_ - p_before;
  bool do_answers_hold = true;
  for (Part& part : parts_) {
    const ShellNode& node = shell_->nodes[part.node];
    const double of_points = (turn * node.centre_S.cast<double>() + shift).norm() + turned * node.radius_m;
    part.gone_m += std::min(of_points, of_solid);
    if (!(part.gone_m > kFarthest_m)) continue;
    start_again_from_0(part);
    do_answers_hold = false;
  }
  if (!do_answers_hold) std::ranges::fill(answers_, CutNode{});
}

// Single precision is kept that way.
void ShellCandidates::start_again_from_0(Part& part) noexcept {
  for (CutNode& entry : std::span(cut_).subspan(part.begin, part.count)) {
    entry.asked_again_at_m = rounded_down(entry.asked_again_at_m - part.gone_m);
  }
  part.asked_again_at_m = -std::numeric_limits<double>::infinity();
  part.looked_over_at_m -= part.gone_m;
  part.gone_m = 0;
}

// False: there are more than there is room for.
bool ShellCandidates::walk(double band_m) noexcept {
  std::swap(cut_, old_cut_);
  cut_.clear();
  candidates_.clear();
  contacts_ = 0;
  near_count_ = 0;
  may_look_over_ = !field_->planes().empty();
  const std::uint32_t points_before = work_.points;
  const std::uint32_t share = !has_walked_ ? kFirstCutLooks : steps_at_level_ > 1 ? kWalkLooks : kNewCutLooks;
  looks_end_ =
      level_ == coarsest_level_ ? std::numeric_limits<std::uint32_t>::max() : work_.looks() + share * most_looks();
  for (Part& part : parts_) {
    if (!walk_part(part, band_m)) return false;
  }
  walk_points_ = work_.points - points_before;
  return true;
}

bool ShellCandidates::walk_part(Part& part, double band_m) noexcept {
  const auto entries = std::span(old_cut_).subspan(part.begin, part.count);
  const auto begin = static_cast<std::uint32_t>(cut_.size());
  const bool is_due = part.gone_m > part.looked_over_at_m && may_look_over_;
  if (!is_due && part.gone_m + band_m < part.asked_again_at_m) {
    if (cut_.size() + entries.size() > cut_limit()) return false;
    cut_.insert(cut_.end(), entries.begin(), entries.end());
  } else {
    root_ = part.node;
    is_question_open_ = false;
    const bool is_whole = is_due && part.has_open_question;
    if (is_whole && !open(part.node, part.gone_m, band_m)) return false;
    bool was_asked = false;  // the entry before
    for (std::size_t i = 0; i < entries.size() && !is_whole; ++i) {
      const CutNode& entry = entries[i];
      // What is asked next is on its way while this is asked.
      if (i + 2 < entries.size() && !entries[i + 2].is_known(part.gone_m, band_m)) {
        __builtin_prefetch(&shell_->nodes[entries[i + 2].node]);
      }
      if (i + 1 < entries.size() && entries[i + 1].is_leaf && !entries[i + 1].is_known(part.gone_m, band_m)) {
        LeafSamples::prefetch(*shell_, shell_->nodes[entries[i + 1].node]);
      }
      bool has_room = false;
      const bool is_known = entry.is_known(part.gone_m, band_m);
      if (!is_known) {
        has_room = entry.is_leaf ? open_leaf(entry, part.gone_m, band_m) : open(entry.node, part.gone_m, band_m);
      } else if (entry.planes != 0) {
        has_room = add_planes(entry.node, entry.planes) && put(entry);
      } else {
        has_room = was_asked ? keep(entry, part.gone_m, band_m) : put(entry);
      }
      if (!has_room || (is_due && !join_above_planes(part.gone_m, band_m))) return false;
      was_asked = !is_known;
    }
    may_look_over_ = may_look_over_ && !is_due;
    if (is_question_open_ && steps_at_level_ <= 1) {
      part.has_open_question = true;
      part.looked_over_at_m = part.gone_m;
    } else if (is_due && !is_question_open_) {
      const bool was_worth_it = 5 * (cut_.size() - begin) <= 4 * entries.size();
      part.looked_over_after_m = was_worth_it ? kLookOver_m : std::min(2 * part.looked_over_after_m, kMaxLookOver_m);
      part.looked_over_at_m = part.gone_m + share_of(part.node) * part.looked_over_after_m;
      part.has_open_question = false;
    }
    part.asked_again_at_m = std::numeric_limits<double>::infinity();
    for (std::size_t i = begin; i < cut_.size(); ++i) {
      const double at_m = cut_[i].planes != 0 ? part.gone_m : double{cut_[i].asked_again_at_m};
      part.asked_again_at_m = std::min(part.asked_again_at_m, at_m);
    }
  }
  part.begin = begin;
  part.count = static_cast<std::uint32_t>(cut_.size()) - begin;
  return true;
}

// All below a node. False: there is no room.
bool ShellCandidates::open(std::uint32_t root, double gone_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  const std::uint32_t end = nodes[root].next;
  for (std::uint32_t i = root; i < end;) {
    const ShellNode& node = nodes[i];
    ++work_.nodes;
    if (work_.looks() > looks_end_) return false;
    const double nearest = nearest_m(node);
    const bool is_far = nearest > band_m, is_small = node.count <= leaf_points(nearest);
    const CutNode above = is_far || is_small ? CutNode{} : planes_below(i, gone_m);
    if (is_far) {
      if (!keep({.node = i, .asked_again_at_m = rounded_down(gone_m + nearest)}, gone_m, band_m)) return false;
      i = node.next;
    } else if (above.planes != 0) {
      if (!open_planes(above, gone_m, band_m)) return false;
      i = node.next;
    } else if (is_small || node.is_leaf) {
      if (!open_leaf({.node = i}, gone_m, band_m)) return false;
      i = node.next;
    } else {
      ++i;
    }
  }
  return true;
}

// Of its points, those that may be near: of the others is known until when they are not.
bool ShellCandidates::open_leaf(const CutNode& entry, double gone_m, double band_m) noexcept {
  const ShellNode& node = shell_->nodes[entry.node];
  // As long as none of a larger node's points can press, some of them are enough.
  double divided_at_m = std::numeric_limits<double>::infinity();
  if (!node.is_leaf && node.count > leaf_points(0)) {
    const double nearest = nearest_m(node);
    if (entry.is_leaf && node.count > leaf_points(nearest)) return open(entry.node, gone_m, band_m);
    divided_at_m = gone_m + nearest - kMayPress_m + least_band_m_;
  }
  const double up_to_m = gone_m + band_m - entry.asked_again_at_m;
  const LeafSamples leaf(*shell_, node, *field_, R_FP_, p_FP_, entry.lags, entry.is_leaf ? up_to_m : band_m);
  work_.points += leaf.asked();
  if (work_.looks() > looks_end_) return false;
  near_count_ += leaf.near_count(band_m);
  const std::size_t before = candidates_.size();
  if (level_ == kFine) {
    leaf.add_points(band_m, candidates_);
  } else {
    leaf.add_joined(band_m, rigid_depth_m_, level_ == coarsest_level_, candidates_);
  }
  contacts_ += candidates_.size() - before;
  if (contacts_ > capacity_) return false;

  CutNode asked{.node = entry.node, .lags = entry.lags, .is_leaf = true};
  const double at_m = leaf.asked_again(gone_m, least_band_m_, entry.asked_again_at_m, asked.lags);
  asked.asked_again_at_m = rounded_down(std::min(at_m, divided_at_m));
  return keep(asked, gone_m, band_m);
}

// Takes the place of its halves where that serves for some steps. False: there is no room.
bool ShellCandidates::keep(CutNode entry, double gone_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  while (!cut_.empty() && entry.planes == 0 && entry.node != root_) {
    const CutNode& before = cut_.back();
    if (before.planes != 0 || before.node <= root_ || nodes[before.node].next != entry.node) break;
    const std::uint32_t parent = before.node - 1;
    if (nodes[parent].is_leaf || nodes[parent].next != nodes[entry.node].next) break;
    const float at_m = std::min(before.asked_again_at_m, entry.asked_again_at_m);
    if (!(at_m > gone_m + band_m + kJoinAt_m)) break;
    entry = {.node = parent, .asked_again_at_m = at_m};
    cut_.pop_back();
  }
  return put(entry);
}

bool ShellCandidates::put(const CutNode& entry) noexcept {
  if (cut_.size() >= cut_limit()) return false;
  cut_.push_back(entry);
  return true;
}

// The last two of the cut, if they are halves of a node above planes; and so on up. False: there is no room.
bool ShellCandidates::join_above_planes(double gone_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  while (cut_.size() > 1) {
    const CutNode &first = cut_[cut_.size() - 2], &last = cut_.back();
    const auto is_near = [&](const CutNode& entry) { return entry.planes != 0 || !entry.is_known(gone_m, band_m); };
    if (first.node <= root_ || nodes[first.node].next != last.node || !(is_near(first) || is_near(last))) return true;
    const std::uint32_t parent = first.node - 1;
    if (nodes[parent].is_leaf || nodes[parent].next != nodes[last.node].next) return true;
    const CutNode above = planes_below(parent, gone_m);
    if (above.planes == 0) return true;
    std::size_t size = candidates_.size(), contacts = 0, near = 0;
    for (; size > 0 && candidates_[size - 1].first >= nodes[parent].first; --size) {
      const ShellCandidate& old = candidates_[size - 1];
      const std::size_t count = old.planes == 0 ? 1 : contacts_of(old.node, old.planes);
      contacts += count;
      near += old.planes != 0 ? count : level_ == kFine ? old.count : 0;
    }
    if (contacts_ - contacts + contacts_of(parent, above.planes) > capacity_) return true;
    candidates_.resize(size);
    contacts_ -= contacts;
    near_count_ -= near;
    cut_.resize(cut_.size() - 2);
    if (!open_planes(above, gone_m, band_m)) return false;
  }
  return true;
}

// For all places that the node may go to until it is asked again.
ShellCandidates::CutNode ShellCandidates::planes_below(std::uint32_t index, double gone_m) noexcept {
  const ShellNode& node = shell_->nodes[index];
  if (node.flat == ShellNode::kNotFlat || solid_radius_m_ < kMinSolid_m) return {};
  CutNode& answer = answers_[index % kAnswers];
  if (answer.node == index && gone_m < answer.asked_again_at_m) return answer;
  OrientedBox box_F = shell_->flat_nodes[node.flat].box_S().moved(R_FP_, p_FP_);
  // How far the shapes move is measured at the solid: what is farther out may move more.
  const bool is_beside = (box_F.centre - solid_centre_F_).norm() + box_F.half_m.norm() > kSideways * solid_radius_m_;
  if (is_beside) return {};
  // What was above planes is asked in any case; what is not asked now, when its part is looked over.
  const bool was_above = answer.node == index && answer.planes != 0;
  if (!was_above && plane_questions_ >= (steps_at_level_ > 1 ? kMaxQuestions : kMaxFirstQuestions)) {
    is_question_open_ = true;
    return {};
  }
  plane_questions_ += was_above ? 0 : 1;
  box_F.half_m.array() += kSideways * kPlaneMotion_m;
  const PlaneSet planes = largest_over(field_->planes(), field_->planes_over(box_F), box_F);
  const double good_for_m = planes != 0 ? kPlaneMotion_m : share_of(index) * kNoPlanes_m;
  answer = {.node = index, .asked_again_at_m = rounded_down(gone_m + good_for_m), .planes = planes};
  return answer;
}

std::size_t ShellCandidates::contacts_of(std::uint32_t index, PlaneSet planes) const {
  return contacts_of_node(shell_->nodes[index], static_cast<std::size_t>(std::popcount(planes)));
}

// A node above planes. False: there is no room.
bool ShellCandidates::open_planes(const CutNode& above, double gone_m, double band_m) noexcept {
  const OrientedBox box_F = shell_->flat_nodes[shell_->nodes[above.node].flat].box_S().moved(R_FP_, p_FP_);
  double nearest = -std::numeric_limits<double>::infinity();
  for (PlaneSet rest = above.planes; rest != 0; rest &= rest - 1) {
    const FieldPlane& plane_F = field_->planes()[static_cast<std::size_t>(std::countr_zero(rest))];
    nearest = std::max(nearest, plane_F.distance_m(box_F.centre) - box_F.reach_m(plane_F.normal));
  }
  nearest -= 2 * field_->error_m() + kRounding_m;
  if (nearest > band_m) {
    return keep({.node = above.node, .asked_again_at_m = rounded_down(gone_m + nearest)}, gone_m, band_m);
  }
  const float at_m =
      std::min<float>(rounded_down(gone_m + share_of(above.node) * kPlaneMotion_m), above.asked_again_at_m);
  return add_planes(above.node, above.planes) &&
         put({.node = above.node, .asked_again_at_m = at_m, .planes = above.planes});
}

// False: there is no room.
bool ShellCandidates::add_planes(std::uint32_t index, PlaneSet planes) noexcept {
  const ShellNode& node = shell_->nodes[index];
  const std::size_t contacts = contacts_of(index, planes);
  contacts_ += contacts;
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

}  // namespace tandem::contact
