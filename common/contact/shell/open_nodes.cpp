// Functions that query nodes of the cut, that is, compute their distances. A queried node becomes a far entry of the
// new cut, a leaf or a node above planes, or its children are queried. cut_node.hpp defines the terms.
#include <algorithm>
#include <bit>
#include <limits>

#include "common/contact/field/oriented_box.hpp"
#include "common/contact/shell/shell_candidates.hpp"

namespace tandem::contact {

// Queries a node. If it is near and larger than a leaf, queries its children instead, and so on. Returns false if the
// cut, the list of candidates or the limit of queries is exceeded.
bool ShellCandidates::open(std::uint32_t root, double root_nearest_m, double moved_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  const std::uint32_t end = nodes[root].next;
  for (std::uint32_t i = root; i < end;) {
    const ShellNode& node = nodes[i];
    ++walk_.work.nodes;
    if (walk_.work.queries() > walk_.query_limit) return false;
    const double nearest = i == root ? root_nearest_m : nearest_m(node);
    const bool is_far = nearest > band_m, is_small = node.count <= levels_.leaf_points(nearest);
    // A flat node above planes needs only a few contacts, even if it has more points than a leaf of the current level.
    const bool may_be_flat = !is_far && node.count > std::min(levels_.leaf_points(nearest), kSearch.planes_above);
    const CutNode above = may_be_flat ? planes_.planes_below(i, moved_m, motion_) : CutNode{};
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

// Samples those points of a leaf that may be nearer than the band, according to their bounds. Returns false if the cut,
// the list of candidates or the limit of queries is exceeded.
bool ShellCandidates::open_leaf(const CutNode& entry, double moved_m, double band_m) noexcept {
  const ShellNode& node = shell_->nodes[entry.node];
  // A leaf with more points than a leaf of level 0 is represented by eight samples. These suffice until some point of
  // the leaf may come nearer to the surface than kSearch.may_press_m. divided_at_m is the bound for that motion.
  double divided_at_m = std::numeric_limits<double>::infinity();
  if (!node.is_leaf && node.count > levels_.leaf_points(0)) {
    const double nearest = nearest_m(node);
    if (entry.is_leaf && node.count > levels_.leaf_points(nearest)) return open(entry.node, nearest, moved_m, band_m);
    divided_at_m = moved_m + nearest - kSearch.may_press_m + least_band_m_;
  }
  const double up_to_m = moved_m + band_m - entry.query_again_at_m;
  const LeafSamples leaf(*shell_, node, *field_, motion_.R_FP(), motion_.p_FP(), entry.lags,
                         entry.is_leaf ? up_to_m : band_m, rigid_depth_m_);
  walk_.work.points += leaf.queries();
  if (walk_.work.queries() > walk_.query_limit) return false;
  if (!list_.add(leaf, band_m, levels_.is_fine(), rigid_depth_m_, levels_.is_coarsest())) return false;

  CutNode queried{.node = entry.node, .lags = entry.lags, .is_leaf = true, .is_sampled = leaf.size() < node.count};
  const double at_m = leaf.query_again_at_m(moved_m, least_band_m_, entry.query_again_at_m, queried.lags);
  queried.query_again_at_m = rounded_down(std::min(at_m, divided_at_m));
  return keep(queried, moved_m, band_m);
}

// Replaces a sampled node by its children. Returns false if the cut, the list of candidates or the limit of queries is
// exceeded.
bool ShellCandidates::open_children(std::uint32_t root, double moved_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  const std::uint32_t queries = walk_.work.queries(), points = walk_.work.points;
  bool has_room = true;
  for (std::uint32_t i = root + 1; has_room && i < nodes[root].next; i = nodes[i].next) {
    const double nearest = nearest_m(nodes[i]);
    const CutNode above = nearest > band_m ? CutNode{} : planes_.planes_below(i, moved_m, motion_);
    walk_.work.nodes += above.planes != 0 ? 1 : 0;
    has_room = above.planes != 0 ? open_planes(above, moved_m, band_m) : open(i, nearest, moved_m, band_m);
  }
  levels_.note_divided();
  walk_.divide_points += walk_.work.points - points;
  walk_.divide_queries -= std::min(walk_.divide_queries, walk_.work.queries() - queries);
  return has_room;
}

// Adds a node above planes as a candidate. If all its planes are farther away than the band, the node becomes a far
// entry of the cut instead. Returns false if the cut or the list of candidates is full.
bool ShellCandidates::open_planes(const CutNode& above, double moved_m, double band_m) noexcept {
  const OrientedBox box_F =
      shell_->flat_nodes[shell_->nodes[above.node].flat].box_S().moved(motion_.R_FP(), motion_.p_FP());
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
      std::min<float>(rounded_down(moved_m + share_of(above.node) * kSearch.plane_motion_m), above.query_again_at_m);
  return list_.add_planes(above.node, above.planes) &&
         append({.node = above.node, .query_again_at_m = at_m, .planes = above.planes});
}

// Joins the last two entries of the cut if they are the halves of a node that is above planes: the node replaces them.
// Then does the same with the new last entry, and so on. Returns false if the cut or the list of candidates is full.
bool ShellCandidates::join_above_planes(double moved_m, double band_m) noexcept {
  const auto& nodes = shell_->nodes;
  while (cut_.size() > 1) {
    const CutNode &first = cut_[cut_.size() - 2], &last = cut_.back();
    const auto is_near = [&](const CutNode& entry) { return entry.planes != 0 || !entry.is_known(moved_m, band_m); };
    if (first.node <= walk_.root || nodes[first.node].next != last.node || !(is_near(first) || is_near(last)))
      return true;
    const std::uint32_t parent = first.node - 1;
    if (nodes[parent].is_leaf || nodes[parent].next != nodes[last.node].next) return true;
    const CutNode above = planes_.planes_below(parent, moved_m, motion_);
    if (above.planes == 0) return true;
    if (!list_.remove_points_of(parent, levels_.is_fine())) return true;
    cut_.resize(cut_.size() - 2);
    if (!open_planes(above, moved_m, band_m)) return false;
  }
  return true;
}

// Returns a lower bound of the distances of all points of a node to the field's surface.
double ShellCandidates::nearest_m(const ShellNode& node) const {
  return nearest_m(node, field_->distance_m(motion_.in_field(node.centre_S)));
}

double ShellCandidates::nearest_m(const ShellNode& node, double distance_m) const {
  return distance_m - node.radius_m - 2 * field_->error_m() - kRounding_m;
}

}  // namespace tandem::contact
