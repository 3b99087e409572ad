// Queries of the nodes of the cut. A queried node is replaced by its children, by a leaf, or by a node above planes.
// Two neighbouring nodes are joined where their parent is sufficient.
#include "common/contact/shell/shell_candidates.hpp"

#include <algorithm>
#include <bit>

#include "common/contact/field/oriented_box.hpp"
#include "common/contact/shell/cut_node.hpp"
#include "common/contact/shell/leaf_samples.hpp"

namespace tandem::contact {
namespace {

// Two halves of a node are joined if both bounds allow a further motion of this fraction of the node's radius. Without
// this margin, the joined node would soon be queried and divided again, since its ball is larger than those of its
// halves. The fraction decreases as the cut fills, and is 0 for the first cut.
constexpr float kJoinAt = 0.5F;
// Motion after which a node above planes is queried again. share_of() reduces it to spread the queries over several
// steps.
constexpr double kPlaneMotion_m = 2e-4;
// Motion after which a node that is not above planes is queried again. share_of() reduces it to between a half and all
// of this.
constexpr double kNoPlanes_m = 6e-4;
// Points of a part move by at most this multiple of the part's motion, in any direction. The motion is measured at the
// ball around the solid, and near points may be a little outside of that ball. The bound fails for solids with a radius
// below kMinSolid_m, for which no planes are queried.
constexpr double kSideways = 1.5;
constexpr double kMinSolid_m = 5e-3;
// Limits of the field's table entries that a step may read for new plane queries: in a usual step, in the first step of
// a level, and for a first cut or a wide band. A plane query of a grid takes up to some microseconds.
constexpr std::size_t kMaxPlaneQueries = 400, kMaxNewLevelPlaneQueries = 2500, kMaxFirstPlaneQueries = 50'000;

}  // namespace

CutNode ShellCandidates::unknown(std::uint32_t node) {
  return {.node = node, .query_again_at_m = -std::numeric_limits<float>::infinity()};
}

// Queries a node and, as far as needed, the nodes below it. Returns false if there is no room.
bool ShellCandidates::open(std::uint32_t root, double root_nearest_m, double moved_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  const std::uint32_t end = nodes[root].next;
  for (std::uint32_t i = root; i < end;) {
    const ShellNode& node = nodes[i];
    ++work_.nodes;
    if (work_.queries() > query_limit_) return false;
    const double nearest = i == root ? root_nearest_m : nearest_m(node);
    const bool is_far = nearest > band_m, is_small = node.count <= leaf_points(nearest);
    // At any level, a flat node above planes needs only a few contacts, even if it is larger than a leaf.
    const bool may_be_flat = !is_far && node.count > std::min(leaf_points(nearest), kPlanesAbove);
    const CutNode above = may_be_flat ? planes_below(i, moved_m) : CutNode{};
    if (is_far) {
      if (!keep({.node = i, .query_again_at_m = rounded_down(moved_m + nearest)}, moved_m, band_m)) return false;
      i = node.next;
    } else if (above.planes != 0) {
      if (!open_planes(above, moved_m, band_m)) return false;
      i = node.next;
    } else if (is_small || node.is_leaf) {
      if (!open_leaf({.node = i}, moved_m, band_m)) return false;
      i = node.next;
    } else {
      ++i;
    }
  }
  return true;
}

// Samples those points of a leaf that may be near. Bounds of the other points still hold.
bool ShellCandidates::open_leaf(const CutNode& entry, double moved_m, double band_m) noexcept {
  const ShellNode& node = shell_->nodes[entry.node];
  // If a leaf has more points than at level 0, eight samples are enough as long as none of its points can press.
  double divided_at_m = std::numeric_limits<double>::infinity();
  if (!node.is_leaf && node.count > leaf_points(0)) {
    const double nearest = nearest_m(node);
    if (entry.is_leaf && node.count > leaf_points(nearest)) return open(entry.node, nearest, moved_m, band_m);
    divided_at_m = moved_m + nearest - kMayPress_m + least_band_m_;
  }
  const double up_to_m = moved_m + band_m - entry.query_again_at_m;
  const LeafSamples leaf(*shell_, node, *field_, R_FP_, p_FP_, entry.lags, entry.is_leaf ? up_to_m : band_m,
                         rigid_depth_m_);
  work_.points += leaf.queries();
  if (work_.queries() > query_limit_) return false;
  near_count_ += leaf.near_count(band_m);
  const std::size_t before = candidates_.size();
  if (level_ == kFine) {
    leaf.add_points(band_m, candidates_);
  } else {
    leaf.add_joined(band_m, rigid_depth_m_, is_coarsest(), candidates_);
  }
  contacts_ += candidates_.size() - before;
  if (contacts_ > capacity_) return false;

  CutNode queried{.node = entry.node, .lags = entry.lags, .is_leaf = true, .is_sampled = leaf.size() < node.count};
  const double at_m = leaf.query_again_at_m(moved_m, least_band_m_, entry.query_again_at_m, queried.lags);
  queried.query_again_at_m = rounded_down(std::min(at_m, divided_at_m));
  return keep(queried, moved_m, band_m);
}

// Replaces a sampled node by its children. Returns false if there is no room.
bool ShellCandidates::open_children(std::uint32_t root, double moved_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  const std::uint32_t queries = work_.queries(), points = work_.points;
  bool has_room = true;
  for (std::uint32_t i = root + 1; has_room && i < nodes[root].next; i = nodes[i].next) {
    const double nearest = nearest_m(nodes[i]);
    const CutNode above = nearest > band_m ? CutNode{} : planes_below(i, moved_m);
    work_.nodes += above.planes != 0 ? 1 : 0;
    has_room = above.planes != 0 ? open_planes(above, moved_m, band_m) : open(i, nearest, moved_m, band_m);
  }
  has_divided_ = true;
  divide_points_ += work_.points - points;
  divide_queries_ -= std::min(divide_queries_, work_.queries() - queries);
  return has_room;
}

// Appends an entry to the cut. If the previous entry is the other half of the same parent, and both bounds allow enough
// motion (kJoinAt), the parent replaces both. Returns false if there is no room.
bool ShellCandidates::keep(const CutNode& entry, double moved_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  const auto known_at_m = static_cast<float>(moved_m + band_m);
  const float full = static_cast<float>(cut_.size()) / static_cast<float>(cut_limit());
  const float share = has_walked_ ? kJoinAt * (1 - full) : 0;
  std::uint32_t node = entry.node;
  float at_m = entry.query_again_at_m;
  bool is_sampled = entry.is_sampled;
  while (!cut_.empty() && entry.planes == 0 && at_m > known_at_m && node != root_) {
    const CutNode& before = cut_.back();
    if (!(before.query_again_at_m > known_at_m) || before.planes != 0 || before.node <= root_) break;
    // Nodes that dividing has just opened are not joined again.
    if (divides_part_ && (is_sampled || before.is_sampled)) break;
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

// Copies the leading entries whose distance bounds still hold and that are above no planes. Returns their number.
std::size_t ShellCandidates::append_known(std::span<const CutNode> entries, double moved_m, double band_m) noexcept {
  const auto most = std::min(entries.size(), cut_limit() - cut_.size());
  std::size_t count = 0;
  float first_at_m = first_at_m_;
  bool has_sampled = has_sampled_;
  for (; count < most && entries[count].planes == 0 && entries[count].is_known(moved_m, band_m); ++count) {
    first_at_m = std::min(first_at_m, entries[count].query_again_at_m);
    has_sampled = has_sampled || entries[count].is_sampled;
  }
  first_at_m_ = first_at_m;
  has_sampled_ = has_sampled;
  cut_.insert(cut_.end(), entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(count));
  return count;
}

bool ShellCandidates::append(const CutNode& entry) noexcept {
  if (cut_.size() >= cut_limit()) return false;
  first_at_m_ =
      std::min(first_at_m_, entry.planes != 0 ? -std::numeric_limits<float>::infinity() : entry.query_again_at_m);
  has_sampled_ = has_sampled_ || entry.is_sampled;
  cut_.push_back(entry);
  return true;
}

// Joins the last two entries of the cut if they are the halves of a node above planes, and repeats this with the joined
// node. Returns false if there is no room.
bool ShellCandidates::join_above_planes(double moved_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  while (cut_.size() > 1) {
    const CutNode &first = cut_[cut_.size() - 2], &last = cut_.back();
    const auto is_near = [&](const CutNode& entry) { return entry.planes != 0 || !entry.is_known(moved_m, band_m); };
    if (first.node <= root_ || nodes[first.node].next != last.node || !(is_near(first) || is_near(last))) return true;
    const std::uint32_t parent = first.node - 1;
    if (nodes[parent].is_leaf || nodes[parent].next != nodes[last.node].next) return true;
    const CutNode above = planes_below(parent, moved_m);
    if (above.planes == 0) return true;
    std::size_t size = candidates_.size(), contacts = 0, more = 0, near = 0;
    for (; size > 0 && candidates_[size - 1].first >= nodes[parent].first; --size) {
      const ShellCandidate& old = candidates_[size - 1];
      const std::size_t count = old.planes == 0 ? 1 : least_contacts_of(nodes[old.node]);
      contacts += count;
      more += more_contacts_of(old.node, old.planes);
      near += old.planes != 0 ? count : level_ == kFine ? old.count : 0;
    }
    if (contacts_ - contacts + least_contacts_of(nodes[parent]) > capacity_) return true;
    candidates_.resize(size);
    contacts_ -= contacts;
    more_contacts_ -= more;
    near_count_ -= near;
    cut_.resize(cut_.size() - 2);
    if (!open_planes(above, moved_m, band_m)) return false;
  }
  return true;
}

// Returns the planes below a node. They are valid for all positions that the node may reach until its next query.
CutNode ShellCandidates::planes_below(std::uint32_t index, double moved_m) noexcept {
  const ShellNode& node = shell_->nodes[index];
  if (node.flat == ShellNode::kNotFlat || solid_radius_m_ < kMinSolid_m) return {};
  CutNode& answer = answers_[index % kAnswers];
  if (answer.node == index && moved_m < answer.query_again_at_m) return answer;
  OrientedBox box_F = shell_->flat_nodes[node.flat].box_S().moved(R_FP_, p_FP_);
  // The motion of a part is measured at the ball around the solid. A node farther out may move by more than kSideways
  // times that motion, so it is not queried.
  const bool is_beside = (box_F.centre - solid_centre_F_).norm() + box_F.half_m.norm() > kSideways * solid_radius_m_;
  if (is_beside) return {};
  // A node that was above planes is always queried. If the limit is used up, other nodes are not queried in this step;
  // the part is checked later (is_question_open_).
  const bool was_above = answer.node == index && answer.planes != 0;
  const bool is_new = !has_walked_ || is_band_wide();
  const std::size_t most = is_new                ? kMaxFirstPlaneQueries
                           : steps_at_level_ > 1 ? kMaxPlaneQueries
                                                 : kMaxNewLevelPlaneQueries;
  if (!was_above && plane_queries_ >= most) {
    is_question_open_ = true;
    return {};
  }
  box_F.half_m.array() += kSideways * kPlaneMotion_m;
  std::size_t queries = 0;
  const PlaneSet planes = largest_over(field_->planes(), field_->planes_over(box_F, queries), box_F);
  if (!was_above) plane_queries_ += queries;
  const double good_for_m = planes != 0 ? kPlaneMotion_m : share_of(index) * kNoPlanes_m;
  answer = {.node = index, .query_again_at_m = rounded_down(moved_m + good_for_m), .planes = planes};
  return answer;
}

// Returns the number of additional contacts that a node needs to represent all of its planes instead of one.
std::size_t ShellCandidates::more_contacts_of(std::uint32_t index, PlaneSet planes) const {
  const auto count = static_cast<std::size_t>(std::popcount(planes));
  return count < 2 ? 0 : (count - 1) * least_contacts_of(shell_->nodes[index]);
}

// Adds a node above planes, or a far node if the planes are beyond the band. Returns false if there is no room.
bool ShellCandidates::open_planes(const CutNode& above, double moved_m, double band_m) noexcept {
  const OrientedBox box_F = shell_->flat_nodes[shell_->nodes[above.node].flat].box_S().moved(R_FP_, p_FP_);
  double nearest = -std::numeric_limits<double>::infinity();
  for (PlaneSet rest = above.planes; rest != 0; rest &= rest - 1) {
    const FieldPlane& plane_F = field_->planes()[static_cast<std::size_t>(std::countr_zero(rest))];
    nearest = std::max(nearest, plane_F.distance_m(box_F.centre) - box_F.reach_m(plane_F.normal));
  }
  nearest -= 2 * field_->error_m() + kRounding_m;
  if (nearest > band_m) {
    return keep({.node = above.node, .query_again_at_m = rounded_down(moved_m + nearest)}, moved_m, band_m);
  }
  const float at_m =
      std::min<float>(rounded_down(moved_m + share_of(above.node) * kPlaneMotion_m), above.query_again_at_m);
  return add_planes(above.node, above.planes) &&
         append({.node = above.node, .query_again_at_m = at_m, .planes = above.planes});
}

// Adds the candidate of a node above planes. Returns false if there is no room.
bool ShellCandidates::add_planes(std::uint32_t index, PlaneSet planes) noexcept {
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

}  // namespace tandem::contact
