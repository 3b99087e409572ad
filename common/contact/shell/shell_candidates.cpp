#include "common/contact/shell/shell_candidates.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "common/contact/contact_shape.hpp"
#include "common/contact/shell/cut_node.hpp"
#include "common/contact/shell/leaf_samples.hpp"

namespace tandem::contact {
namespace {

// Limit of a part's accumulated motion, at which the motion restarts at zero. The cut stores sums of motion and
// distance in single precision.
constexpr double kFarthest_m = 0.25;
// Limits of the queries of a walk, as multiples of max_queries(): in a usual step, in the first step at a coarser
// level, and for a first cut. A wide band doubles the limits.
constexpr std::uint32_t kWalkQueries = 4, kNewLevelQueries = 8, kFirstCutQueries = 16;
// Motion of a part after which the part is checked for pairs of nodes that a node above planes can replace. After a
// face has passed a groove, for example, its small nodes may become one large node again. share_of() spreads the
// checks, and a step checks one part. The motion doubles after a check without success. It is the maximum if plane
// queries were left out and the part moves fast.
constexpr double kHalvesCheckMotion_m = 4e-3, kMaxHalvesCheckMotion_m = 16e-3;
// A part is slow if it moves by less than this in a step.
constexpr double kSlow_m = 2e-5;
// Conditions for join_far(): the level has lasted for more than kStepsToJoin steps, and more than kJoinFarAbove of the
// room for the cut is in use. Two nodes are joined if neither has to be queried before the part has moved by
// kJoinBeyond_m.
constexpr std::uint32_t kStepsToJoin = 100;
constexpr double kJoinFarAbove = 0.45, kJoinBeyond_m = 3e-4;

// Returns the radius of a ball around the shape, centred at the middle of its box. The box contains the shape's points.
// The surface extends beyond it by less than one spacing, which is added.
double radius_of(const ContactShape& shape) {
  return (shape.high_S - shape.low_S).norm() / 2 + shape.shells.surface.spacing_m;
}

double chord(const Quat& a, const Quat& b) {
  return 2 * (a.conjugate() * b).vec().norm();
}

}  // namespace

ContactWork& ContactWork::operator+=(const ContactWork& other) {
  nodes += other.nodes;
  points += other.points;
  is_coarse = is_coarse || other.is_coarse;
  is_refreshed = is_refreshed || other.is_refreshed;
  return *this;
}

/// A subtree of the shell's tree, with the entries of the cut that belong to it. Motion is accumulated for each part
/// separately. When the shape turns, points of a small part move little relative to its centre, so the bound of the
/// motion is tight.
struct ShellCandidates::Part {
  std::uint32_t node = 0;  ///< root of the subtree
  std::uint32_t begin = 0, count = 0;
  double moved_m = 0;               ///< accumulated motion: an upper bound of the approach of the part's points
  double step_motion_m = 0;         ///< motion of the last step, which is included in moved_m
  double query_again_at_m = 0;      ///< least query_again_at_m of the part's nodes
  double halves_check_at_m = 0;     ///< accumulated motion at the next check for halves to join above planes
  double halves_check_after_m = 0;  ///< motion between that check and the following one
  bool has_open_question = false;   ///< the limit left some node without a plane query; the next check rebuilds the cut
  bool waits_for_rest = false;      ///< the next check waits until the part is slow or has moved far
  bool has_sampled = false;         ///< the part may have sampled nodes, of which eight points represent all points
};

/// Result of a level: the members that keep_found() stores.
struct ShellCandidates::Found {
  std::tuple<int, std::vector<Part>, std::vector<CutNode>, std::size_t, std::uint32_t, bool> all;
};

ShellCandidates::ShellCandidates(ShellCandidates&& other) noexcept = default;
ShellCandidates::~ShellCandidates() = default;

ShellCandidates::ShellCandidates(std::uint32_t capacity)
    : largest_capacity_(capacity), capacity_(capacity), before_(std::make_unique<Found>()) {
  for (auto* parts : {&parts_, &std::get<std::vector<Part>>(before_->all)}) parts->reserve(kParts + 1);
  candidates_.reserve(capacity + kShellLeafPoints);
  // A trial of a finer level begins only while at most half of the room is in use, so the stored cut needs half of the
  // room.
  std::get<std::vector<CutNode>>(before_->all).reserve(cut_limit() / 2);
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
  contacts_ = more_contacts_ = 0;
  gap_m_ = -1;
  has_walked_ = false;
  least_band_m_ = std::numeric_limits<double>::infinity();
  steps_to_try_ = 0;
  steps_per_try_ = kStepsPerTry;
  dense_steps_ = 0;
  is_try_ = tries_when_divided_ = has_rested_ = false;
  steps_to_divide_ = kStepsToDivide;
  divided_up_to_ = 0;
  // At the coarsest level, a part that is not divided gives two candidates.
  divide(std::clamp<std::size_t>(capacity_ / 4, 1, kParts));
  std::ranges::fill(answers_, CutNode{});
  std::uint32_t most_points = 0;
  for (const Part& part : parts_) most_points = std::max(most_points, shell_->nodes[part.node].count);
  for (level_ = 0; leaf_points(0) < most_points;) ++level_;
  coarsest_level_ = level_;
  set_level(kFine);
  begin_cut();
}

// Returns whether some part may have sampled nodes, of which eight points represent all points.
bool ShellCandidates::has_sampled() const {
  return std::ranges::any_of(parts_, &Part::has_sampled);
}

// Divides the tree into subtrees, splitting the largest first.
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

// Starts a cut with one node for each part, which has not been queried yet.
void ShellCandidates::begin_cut() noexcept {
  cut_.clear();
  for (Part& part : parts_) {
    part.begin = static_cast<std::uint32_t>(cut_.size());
    part.count = 1;
    part.query_again_at_m = -std::numeric_limits<double>::infinity();
    part.halves_check_after_m = kHalvesCheckMotion_m;
    part.halves_check_at_m = part.moved_m + share_of(part.node) * kHalvesCheckMotion_m;
    part.has_open_question = part.waits_for_rest = false;
    cut_.push_back(unknown(part.node));
  }
}

void ShellCandidates::set_level(int level) noexcept {
  level_ = level;
  is_try_ = false;
  has_divided_ = false;
  steps_at_level_ = steps_of_join_ = 0;
  dense_steps_ = 0;
}

// Changes the level. Bounds of far nodes remain valid and are kept. A new cut is started at the coarsest level, and for
// a wide band, in which few bounds would hold.
void ShellCandidates::change_level(int level) noexcept {
  const bool is_finer = level < level_;
  set_level(level);
  if (level_ == coarsest_level_ || is_band_wide()) return begin_cut();
  std::swap(cut_, old_cut_);
  cut_.clear();
  for (Part& part : parts_) {
    const auto entries = std::span(old_cut_).subspan(part.begin, part.count);
    part.begin = static_cast<std::uint32_t>(cut_.size());
    for (const CutNode& entry : entries) {
      if (!is_finer) {
        append_as_coarse(entry, part);
      } else {
        const bool is_fine = entry.is_leaf && shell_->nodes[entry.node].count <= leaf_points(0);
        const bool is_divided = entry.is_sampled && !is_fine;
        cut_.push_back(is_divided ? unknown(entry.node) : entry);
        if (is_divided) part.query_again_at_m = -std::numeric_limits<double>::infinity();
      }
    }
    part.count = static_cast<std::uint32_t>(cut_.size()) - part.begin;
  }
}

// Appends an entry at a coarser level. If the previous entry is the other half of the same parent, the parent may
// replace both. The parent must be small enough for a leaf at this level, and one of the halves must be near.
void ShellCandidates::append_as_coarse(CutNode entry, Part& part) noexcept {
  const auto& nodes = shell_->nodes;
  const std::uint32_t most_points = leaf_points(std::numeric_limits<double>::infinity());
  const auto is_near = [](const CutNode& a) {
    return a.is_leaf || a.planes != 0 || !(a.query_again_at_m > -std::numeric_limits<float>::infinity());
  };
  const auto query = [&](std::uint32_t node) {
    entry = unknown(node);
    part.query_again_at_m = -std::numeric_limits<double>::infinity();
  };
  if (entry.planes != 0 && nodes[entry.node].count <= std::min(most_points, kPlanesAbove)) query(entry.node);
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

// Undoes one level of dividing. If both halves of a divided node are in the cut, the node replaces them. Undoing all
// levels at once would leave eight points for a whole part. Returns false if there was nothing to join.
bool ShellCandidates::join_pairs() noexcept {
  const auto& nodes = shell_->nodes;
  set_level(level_);
  std::swap(cut_, old_cut_);
  cut_.clear();
  for (Part& part : parts_) {
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
      cut_.back() = unknown(parent);
      part.query_again_at_m = -std::numeric_limits<double>::infinity();
      was_joined = has_divided_ = true;
    }
    part.count = static_cast<std::uint32_t>(cut_.size()) - part.begin;
  }
  return has_divided_;
}

// Stores the result of the current level. Returns false if the cut is too large to be stored.
bool ShellCandidates::keep_found() noexcept {
  if (cut_.size() > std::get<std::vector<CutNode>>(before_->all).capacity()) return false;
  before_->all = std::tie(level_, parts_, cut_, contacts_, steps_at_level_, has_divided_);
  return true;
}

void ShellCandidates::restore_found() noexcept {
  set_level(std::get<int>(before_->all));
  std::tie(level_, parts_, cut_, contacts_, steps_at_level_, has_divided_) = before_->all;
}

// Returns whether the shapes are still so far apart that no point can be near. This needs only a comparison of poses.
bool ShellCandidates::is_out_of_reach(const Pose& X_FP, double band_m) noexcept {
  if (gap_m_ < 0) return false;
  const double motion =
      (X_FP * points_centre_P_ - X_FP_gap_ * points_centre_P_).norm() + chord(X_FP_gap_.q, X_FP.q) * points_radius_m_;
  return motion + band_m <= gap_m_;
}

void ShellCandidates::remember_gap(const Pose& X_FP) noexcept {
  gap_m_ = -1;
  // Above level 0, only some points of a leaf are sampled, so the distance to the nearest point is unknown.
  if (!candidates_.empty() || level_ > 0) return;
  gap_m_ = std::numeric_limits<double>::infinity();
  for (const Part& part : parts_) gap_m_ = std::min(gap_m_, part.query_again_at_m - part.moved_m);
  X_FP_gap_ = X_FP;
}

// Bounds of points were computed for the narrowest band so far. If the band becomes narrower, they may fail in a steep
// field. The difference of the bands therefore counts as motion.
void ShellCandidates::allow_band(double band_m) noexcept {
  band_m_ = band_m;
  if (band_m >= least_band_m_) return;
  if (std::isfinite(least_band_m_)) {
    for (Part& part : parts_) part.moved_m += (1 - 1 / kSteepest) * (least_band_m_ - band_m);
  }
  least_band_m_ = band_m;
}

// Adds the motion of this step to each part. Two motions are computed: that of the points in the field's frame, and
// that of the solid in the frame of the points. Each of them bounds the change of distances, so the smaller one is
// used. A small tool may thus turn above a large table without new queries.
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
    part.step_motion_m = std::min(of_points, of_solid);
    part.moved_m += part.step_motion_m;
    if (!(part.moved_m > kFarthest_m)) continue;
    start_again_from_0(part);
    do_answers_hold = false;
  }
  if (!do_answers_hold) std::ranges::fill(answers_, CutNode{});
}

// Restarts the accumulated motion of a part at zero, so that single precision remains sufficient for the bounds.
void ShellCandidates::start_again_from_0(Part& part) noexcept {
  for (CutNode& entry : std::span(cut_).subspan(part.begin, part.count)) {
    entry.query_again_at_m = rounded_down(entry.query_again_at_m - part.moved_m);
  }
  part.query_again_at_m = -std::numeric_limits<double>::infinity();
  part.halves_check_at_m -= part.moved_m;
  part.moved_m = 0;
}

// Joins nodes far beyond the band. A shell that has moved past many obstacles leaves a cut of many small far nodes.
// They are not queried again, but occupy room that near nodes need.
void ShellCandidates::join_far() noexcept {
  const auto& nodes = shell_->nodes;
  std::size_t size = 0;
  for (Part& part : parts_) {
    const std::size_t begin = size;
    const auto far_at_m = static_cast<float>(part.moved_m + band_m_ + kJoinBeyond_m);
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

// Traverses the cut once and queries the nodes whose bounds no longer hold. Returns false if there is no room for all
// nodes or candidates, or if the limit of queries is exceeded.
bool ShellCandidates::walk(double band_m) noexcept {
  divide_queries_ = queries_to_divide();
  divide_points_ = 0;
  std::swap(cut_, old_cut_);
  const bool is_full = static_cast<double>(old_cut_.size()) > kJoinFarAbove * static_cast<double>(cut_limit());
  if (is_full && level_ != kFine && steps_at_level_ > kStepsToJoin + steps_of_join_) {
    join_far();
    steps_of_join_ = steps_at_level_;
  }
  cut_.clear();
  candidates_.clear();
  contacts_ = more_contacts_ = 0;
  near_count_ = 0;
  may_check_halves_ = !field_->planes().empty();
  const std::uint32_t points_before = work_.points;
  const std::uint32_t share = !has_walked_                     ? kFirstCutQueries
                              : is_try_ || steps_at_level_ > 1 ? kWalkQueries
                                                               : kNewLevelQueries;
  const std::uint32_t queries = (is_band_wide() ? 2 : 1) * share * max_queries();
  query_limit_ =
      is_coarsest() ? std::numeric_limits<std::uint32_t>::max() : work_.queries() + queries + divide_queries_;
  const std::size_t divided_up_to = std::exchange(divided_up_to_, 0);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    divides_part_ = divide_queries_ > 0 && parts_[i].has_sampled && i >= divided_up_to;
    if (!walk_part(parts_[i], band_m)) {
      keep_rest(i);
      return false;
    }
    if (divides_part_ && divide_queries_ == 0) divided_up_to_ = i;
  }
  walk_points_ = work_.points - points_before - divide_points_;
  end_dividing();
  return true;
}

/// Batches the distance queries of the next nodes of the cut by eight, so that their memory accesses overlap.
class ShellCandidates::Ahead {
 public:
  Ahead(const ShellCandidates& search, std::span<const CutNode> entries, double moved_m, double band_m)
      : search_(search), entries_(entries), moved_m_(moved_m), band_m_(band_m) {}

  /// Returns the next distance. Must be called once for each inner node that needs a query, in order.
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
      const Vec3 centre_F = search_.R_FP_ * nodes[i]->centre_S.cast<double>() + search_.p_FP_;
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

// Restores the old cut of the part in which the walk ended early, and of all later parts.
void ShellCandidates::keep_rest(std::size_t part) noexcept {
  cut_.resize(part == 0 ? 0 : parts_[part - 1].begin + parts_[part - 1].count);
  for (; part < parts_.size(); ++part) {
    const auto entries = std::span(old_cut_).subspan(parts_[part].begin, parts_[part].count);
    if (cut_.size() + entries.size() > cut_limit()) return begin_cut();
    parts_[part].begin = static_cast<std::uint32_t>(cut_.size());
    cut_.insert(cut_.end(), entries.begin(), entries.end());
  }
}

bool ShellCandidates::walk_part(Part& part, double band_m) noexcept {
  const auto entries = std::span(old_cut_).subspan(part.begin, part.count);
  const auto begin = static_cast<std::uint32_t>(cut_.size());
  const bool is_slow = part.step_motion_m < kSlow_m;
  const bool is_due = may_check_halves_ && (part.moved_m > part.halves_check_at_m || (part.waits_for_rest && is_slow));
  if (!is_due && !divides_part_ && part.moved_m + band_m < part.query_again_at_m) {
    if (cut_.size() + entries.size() > cut_limit()) return false;
    cut_.insert(cut_.end(), entries.begin(), entries.end());
  } else {
    root_ = part.node;
    is_question_open_ = has_sampled_ = false;
    first_at_m_ = std::numeric_limits<float>::infinity();
    const bool is_whole = is_due && part.has_open_question;
    if (is_whole && !open(part.node, nearest_m(shell_->nodes[part.node]), part.moved_m, band_m)) return false;
    Ahead ahead(*this, entries, part.moved_m, band_m);
    bool was_queried = false;  // whether the previous entry was queried
    for (std::size_t i = 0; i < entries.size() && !is_whole; ++i) {
      if (!was_queried && !is_due && !divides_part_) i += append_known(entries.subspan(i), part.moved_m, band_m);
      if (i == entries.size()) break;
      const CutNode& entry = entries[i];
      bool has_room = false;
      const bool is_known = entry.is_known(part.moved_m, band_m);
      const bool is_divided = entry.is_sampled && divides_part_ && divide_queries_ > 0;
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
        has_room = add_planes(entry.node, entry.planes) && append(entry);
      } else {
        has_room = was_queried ? keep(entry, part.moved_m, band_m) : append(entry);
      }
      if (!has_room || (is_due && !join_above_planes(part.moved_m, band_m))) return false;
      was_queried = !is_known || is_divided;
    }
    may_check_halves_ = may_check_halves_ && !is_due;
    if (is_question_open_ && steps_at_level_ <= 1) {
      part.has_open_question = true;
      part.halves_check_at_m = part.moved_m;
    } else if (is_due && is_question_open_) {
      // In slow motion, the results of plane queries stay valid until the next steps complete the check. In fast motion
      // they expire too soon, so the check waits.
      part.waits_for_rest = !is_slow;
      part.halves_check_at_m = part.moved_m + (is_slow ? 0 : share_of(part.node) * kMaxHalvesCheckMotion_m);
    } else if (is_due) {
      const bool was_worth_it = 5 * (cut_.size() - begin) <= 4 * entries.size();
      part.halves_check_after_m =
          was_worth_it ? kHalvesCheckMotion_m : std::min(2 * part.halves_check_after_m, kMaxHalvesCheckMotion_m);
      part.halves_check_at_m = part.moved_m + share_of(part.node) * part.halves_check_after_m;
      part.has_open_question = part.waits_for_rest = false;
    }
    part.query_again_at_m = first_at_m_;
    part.has_sampled = has_sampled_;
  }
  part.begin = begin;
  part.count = static_cast<std::uint32_t>(cut_.size()) - begin;
  return true;
}

}  // namespace tandem::contact
