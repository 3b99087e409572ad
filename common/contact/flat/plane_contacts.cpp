#include "common/contact/flat/plane_contacts.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <boost/container/static_vector.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "common/contact/contact_point.hpp"
#include "common/contact/field/plane_map.hpp"
#include "common/contact/points/point_shell.hpp"
#include "common/contact/points/polygon.hpp"
#include "common/contact/shell/shell_candidate.hpp"

namespace tandem::contact {
namespace {

// Points whose depths differ by at most this value may be merged in any case. The value is a few times the rounding
// error of points and distances.
constexpr double kSpan_m = 5e-6;
// Points that all press, or all have a gap, may differ more in depth: by the value above plus this fraction of the
// least depth or gap. For pressing points, the sum is at most kMaxSpan_m. The merged contact is less deep than the
// deepest point by a few tenths of the difference.
constexpr double kSpanShare = 0.5;
constexpr double kMaxSpan_m = 5e-5;
// A part of a node with less than this fraction of the node's area gets no contact.
constexpr double kMinShare = 1e-9;
// Least cosine between the normals of contacts that may be merged: the normals differ by at most 0.01 rad.
constexpr double kAlikeCosine = 1 - 5e-5;

/// Returns whether points with depths from `low` to `high` may be merged.
bool is_alike(double low, double high, double rigid_depth_m) {
  const bool is_cut = low < 0 && high > 0;
  const bool is_half_rigid = low < rigid_depth_m && high > rigid_depth_m;
  double most = kSpan_m;
  if (!is_cut && !is_half_rigid) most += kSpanShare * std::min(std::abs(low), std::abs(high));
  if (low >= 0) most = std::min(most, kMaxSpan_m);
  return high - low <= most;
}

/// Mean of contacts. Pressing contacts are weighted by force, others by area.
struct Mean {
  double area = 0, depth = 0;  ///< area of the contacts, and the sum of their depth × area
  double low = std::numeric_limits<double>::infinity(), high = -low;
  Vec3 p = Vec3::Zero(), normal = Vec3::Zero();
  Vec3 first_normal = Vec3::Zero();
  bool is_flat = true;

  void add(const ContactPoint& contact) {
    const double weight = contact.area_m2 * (contact.depth_m > 0 ? contact.depth_m : 1);
    if (area == 0) first_normal = contact.normal_W;
    is_flat = is_flat && first_normal.dot(contact.normal_W) >= kAlikeCosine;
    area += contact.area_m2;
    depth += contact.area_m2 * contact.depth_m;
    low = std::min(low, contact.depth_m);
    high = std::max(high, contact.depth_m);
    p += weight * contact.p_W;
    normal += weight * contact.normal_W;
  }
  ContactPoint contact(std::uint32_t first, std::uint32_t end) const {
    ContactPoint mean;
    const double weight = low > 0 ? depth : area;
    mean.p_W = p / weight;
    mean.normal_W = is_flat ? Vec3(normal.normalized()) : first_normal;
    mean.depth_m = depth / area;
    mean.area_m2 = area;
    mean.id = first;
    mean.count = end - first;
    return mean;
  }
};

/// Four points that replace an area. Each has a quarter of the area, and together they have its mean and covariance.
/// They are at mean ± s₁ ± s₂, where s₁ and s₂ are the columns of the Cholesky factor of the covariance.
struct Four {
  double area;
  std::array<double, 4> u, v;

  explicit Four(const AreaMoments& moments) : area(moments(0, 0)) {
    const double mean_u = moments(1, 0) / area, mean_v = moments(2, 0) / area;
    const double uu = std::max(0.0, moments(1, 1) / area - mean_u * mean_u);
    const double uv = moments(2, 1) / area - mean_u * mean_v;
    const double vv = std::max(0.0, moments(2, 2) / area - mean_v * mean_v);
    // Eigenvectors are not used, because they are not a continuous function of the covariance. The Cholesky factor is.
    const double along = std::sqrt(uu);
    const double shear = along > 0 ? std::clamp(uv / along, -std::sqrt(vv), std::sqrt(vv)) : 0;
    const double across = std::sqrt(std::max(0.0, vv - shear * shear));
    for (std::size_t k = 0; k < 4; ++k) {
      const double first = k < 2 ? -1 : 1, second = k % 2 == 0 ? -1 : 1;
      u[k] = mean_u + first * along;
      v[k] = mean_v + first * shear + second * across;
    }
  }
};

/// A plane of the other shape's field that is below a node, in the frame P of the node's points.
struct Below {
  Vec3 normal_W, normal_P;
  double offset_m;

  double distance_m(const Vec3& p_P) const { return normal_P.dot(p_P) + offset_m; }
};
using Planes = boost::container::static_vector<Below, PlaneMap::kMaxInBox>;

/// Upper bound of the number of parts of a node. Real nodes have fewer: at most half a dozen slices for each plane.
constexpr std::size_t kMaxParts = 48;

/// Appends the contacts of nodes, one node at a time.
class NodeContacts {
 public:
  NodeContacts(const PlaneContacts& search, PlaneSet planes, std::vector<ContactPoint>& contacts)
      : search_(search), contacts_(contacts), R_WP_(search.X_WP.q.toRotationMatrix()) {
    const Eigen::Matrix3d R_PF = search.X_FP.q.conjugate().toRotationMatrix();
    for (PlaneSet rest = planes; rest != 0; rest &= rest - 1) {
      const FieldPlane& plane_F = search.planes_F[static_cast<std::size_t>(std::countr_zero(rest))];
      all_.push_back(
          {search.sign * (search.R_WF * plane_F.normal), R_PF * plane_F.normal, plane_F.distance_m(search.X_FP.p)});
    }
  }

  /// Selects those planes that have the largest distance at some point of a box. The plane with the largest distance at
  /// the box's centre becomes the first one.
  ///
  /// Out     bounds of the depth over the box: lower bound, upper bound
  std::pair<double, double> depth_range(const OrientedBox& box) {
    planes_ = all_;
    const auto first = std::ranges::max_element(planes_, std::less{},
                                                [&](const Below& below) { return below.distance_m(box.centre); });
    std::iter_swap(planes_.begin(), first);
    const Below nearest = planes_[0];
    const double distance = nearest.distance_m(box.centre);
    const auto is_farther = [&](const Below& below) {
      return box.reach_m(below.normal_P - nearest.normal_P) <= distance - below.distance_m(box.centre);
    };
    planes_.erase(std::remove_if(planes_.begin() + 1, planes_.end(), is_farther), planes_.end());
    double low = std::numeric_limits<double>::infinity(), high = low;
    for (const Below& below : planes_) {
      const double middle = -below.distance_m(box.centre), reach = box.reach_m(below.normal_P);
      low = std::min(low, middle - reach);
      high = std::min(high, middle + reach);
    }
    return {low, high};
  }
  bool has_one_plane() const { return planes_.size() == 1; }

  void add_points(const ShellNode& node) {
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) add_point(i, i, i + 1, 1);
  }

  /// Adds `count` of the node's points, with the area of the whole node. One of them is the deepest point. The others
  /// are evenly spaced in the order of the shell.
  void add_some_points(const ShellNode& node, std::uint32_t count) {
    const auto index_of = [&](std::uint32_t k) {
      return node.first + static_cast<std::uint32_t>(std::uint64_t{k} * node.count / count);
    };
    const std::uint32_t deepest = deepest_of(node);
    const auto chosen = [&](std::uint32_t k) {
      return deepest >= index_of(k) && deepest < index_of(k + 1) ? deepest : index_of(k);
    };
    double area_m2 = 0;
    for (std::uint32_t k = 0; k < count; ++k) area_m2 += search_.shell.points[chosen(k)].area_m2;
    const double scale = area_m2 > 0 ? node.mean.area_m2 / area_m2 : 1;
    for (std::uint32_t k = 0; k < count; ++k) add_point(chosen(k), index_of(k), index_of(k + 1), scale);
  }

  /// Adds the four contacts of a node above one plane. The node must press as a whole, or not at all.
  void add_whole(const ShellNode& node, const FlatNode& flat) {
    const auto quarters = quarters_of(node);
    const Vec3 mean = flat.mean_S.cast<double>();
    const Vec3 along = flat.deviation_along_m * flat.along_S.cast<double>();
    const Vec3 across = flat.deviation_across_m * flat.across_S.cast<double>();
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec3 p_P = mean + (k < 2 ? -1 : 1) * along + (k % 2 == 0 ? -1 : 1) * across;
      add(planes_[0], p_P, planes_[0].distance_m(p_P), node.mean.area_m2 / 4, quarters[k], quarters[k + 1]);
    }
  }

  /// Adds the contacts of a node's polygon. The polygon is divided into parts with one nearest plane each, and each
  /// part into a pressing piece and a piece with a gap.
  ///
  /// In      is_sliced  true: slices of depth are cut from pieces with a gap, and from pieces deeper than half of the
  ///         rigid depth. The contact of the deepest slice is then nearly as deep as the piece. Pieces that are not cut
  ///         have four contacts each
  /// Out     false if there would be more contacts than `room` (the argument), or more than ids (one per point of the
  ///         node)
  bool add_parts(const ShellNode& node, const FlatNode& flat, std::size_t room, bool is_sliced) {
    const Polygon whole = corners_of(flat);
    const AreaMoments sum = moments_of(whole);
    const double density = 1 / sum(0, 0);
    boost::container::static_vector<DepthSlope, PlaneMap::kMaxInBox> slopes;
    for (const Below& plane : planes_) slopes.push_back(slope_of(plane, flat));
    const std::size_t most_parts = std::min({room / 4, std::size_t{node.count} / 4, parts_.capacity()});
    const auto first_slice_m = [&](double nearest_m) {
      const bool is_linear = nearest_m <= 0 && nearest_m >= -kLinear * search_.rigid_depth_m;
      return is_sliced && !is_linear ? kFirstSlice_m : std::numeric_limits<double>::infinity();
    };
    parts_.clear();
    first_slices_ = 0;
    const auto [nearest_m, farthest_m] = range(whole, slopes[0]);
    const bool is_on_one_side = farthest_m <= 0 || (nearest_m >= 0 && farthest_m <= search_.band_m);
    if (slopes.size() == 1 && is_on_one_side && farthest_m - nearest_m <= first_slice_m(nearest_m)) {
      first_slices_ = slopes[0][0] <= 0 ? 1 : 0;
      if (!add_part(planes_[0], sum * density, most_parts)) return false;
      append_parts(node, flat);
      return true;
    }
    for (const bool is_gap : {false, true}) {
      for (std::size_t i = 0; i < slopes.size(); ++i) {
        Polygon polygon = whole;
        cut(polygon, is_gap ? DepthSlope(-slopes[i]) : slopes[i]);
        if (is_gap) cut(polygon, below(slopes[i], search_.band_m));
        for (std::size_t k = 0; k < slopes.size(); ++k) {
          // A plane is infinite, but its face ends at an edge where another plane has a larger distance. The polygon is
          // cut off there.
          if (k != i) cut(polygon, is_gap ? slopes[k] : DepthSlope(slopes[k] - slopes[i]));
        }
        if (is_empty(polygon)) continue;
        const double slice_m = first_slice_m(is_gap ? 1 : range(polygon, slopes[i]).first);
        if (!add_slices(planes_[i], slopes[i], polygon, slice_m, density, most_parts)) return false;
        if (!is_gap && i == 0) {
          first_slices_ = parts_.size();
          const auto area = [](const auto& part) { return part.second.area; };
          if (!parts_.empty()) std::iter_swap(parts_.begin(), std::ranges::max_element(parts_, std::less{}, area));
        }
      }
    }
    append_parts(node, flat);
    return true;
  }

 private:
  /// Returns the plane with the largest distance to a point, and that distance.
  std::pair<const Below*, double> largest_at(const Vec3& p_P) const {
    std::pair<const Below*, double> largest{nullptr, -std::numeric_limits<double>::infinity()};
    for (const Below& plane : planes_) {
      const double distance = plane.distance_m(p_P);
      if (distance > largest.second) largest = {&plane, distance};
    }
    return largest;
  }

  std::uint32_t deepest_of(const ShellNode& node) const {
    std::uint32_t deepest = node.first;
    double least_m = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const double largest_m = largest_at(search_.shell.points[i].p_S.cast<double>()).second;
      if (largest_m >= least_m) continue;
      least_m = largest_m;
      deepest = i;
    }
    return deepest;
  }

  /// Adds point i, with `scale` times its area. The contact represents the points in [first, end).
  void add_point(std::uint32_t i, std::uint32_t first, std::uint32_t end, double scale) {
    const ShellPoint& point = search_.shell.points[i];
    const Vec3 p_P = point.p_S.cast<double>();
    const auto [largest, largest_m] = largest_at(p_P);
    const auto is_above = [&p_P](const Below& plane) { return plane.distance_m(p_P) > 0; };
    // A point above two planes is beyond an edge of the other shape, and no surface is below it.
    if (largest_m <= 0 || std::ranges::count_if(planes_, is_above) < 2)
      add(*largest, p_P, largest_m, scale * point.area_m2, first, end);
  }

  static DepthSlope slope_of(const Below& plane, const FlatNode& flat) {
    return {plane.distance_m(flat.mean_S.cast<double>()), plane.normal_P.dot(flat.along_S.cast<double>()),
            plane.normal_P.dot(flat.across_S.cast<double>())};
  }

  void append_parts(const ShellNode& node, const FlatNode& flat) {
    const Vec3 mean = flat.mean_S.cast<double>();
    const Vec3 along = flat.along_S.cast<double>();
    const Vec3 across = flat.across_S.cast<double>();
    const auto quarters = quarters_of(node);
    // Each contact must keep its id from step to step, while slices appear and vanish. Each quarter of the points gives
    // ids to one of the four contacts of each slice: the first ids to slices that press on the nearest plane, the last
    // ids to all other slices. The largest slice gets the ids between them.
    const auto first_other = static_cast<std::uint32_t>(std::max<std::size_t>(1, first_slices_));
    for (std::size_t k = 0; k < 4; ++k) {
      const auto append_part = [&](std::uint32_t part, std::uint32_t first, std::uint32_t end) {
        const auto& [plane, four] = parts_[part];
        const Vec3 p_P = mean + four.u[k] * along + four.v[k] * across;
        add(*plane, p_P, plane->distance_m(p_P), four.area * node.mean.area_m2 / 4, first, end);
      };
      const auto count = static_cast<std::uint32_t>(parts_.size());
      std::uint32_t name = quarters[k];
      for (std::uint32_t part = 1; part < first_other; ++part, ++name) append_part(part, name, name + 1);
      const std::uint32_t end = quarters[k + 1] - (count - first_other);
      if (count > 0) append_part(0, name, end);
      for (std::uint32_t part = first_other; part < count; ++part)
        append_part(part, end + part - first_other, end + part - first_other + 1);
    }
  }

  // Thickness of the first slice, which begins at the deepest position. For a strip (whose points have equal areas at
  // all depths), the four contacts of the slice are too shallow by a fifth of this thickness.
  static constexpr double kFirstSlice_m = 1.6e-5;
  static constexpr double kNextSlice = 4;
  // Depth, as a fraction of the rigid depth, up to which a pressing piece is not cut into slices. A deeper piece may
  // exceed the rigid depth within a step, where the force is no longer linear in the depth.
  static constexpr double kLinear = 0.5;

  bool add_slices(const Below& plane, const DepthSlope& slope, Polygon rest, double slice_m, double density,
                  std::size_t most_parts) {
    const auto [nearest_m, farthest_m] = range(rest, slope);
    for (; !is_empty(rest); slice_m *= kNextSlice) {
      if (farthest_m <= nearest_m + slice_m) return add_part(plane, moments_of(rest) * density, most_parts);
      Polygon slice = rest;
      cut(slice, below(slope, nearest_m + slice_m));
      cut(rest, -below(slope, nearest_m + slice_m));
      if (!is_empty(slice) && !add_part(plane, moments_of(slice) * density, most_parts)) return false;
    }
    return true;
  }

  bool add_part(const Below& plane, const AreaMoments& moments, std::size_t most_parts) {
    if (moments(0, 0) < kMinShare) return true;
    if (parts_.size() >= most_parts) return false;
    parts_.push_back({&plane, Four(moments)});
    return true;
  }

  void add(const Below& plane, const Vec3& p_P, double distance, double area_m2, std::uint32_t first,
           std::uint32_t end) {
    if (distance >= search_.band_m) return;
    contacts_.push_back(ContactPoint{.p_W = R_WP_ * p_P + search_.X_WP.p,
                                     .normal_W = plane.normal_W,
                                     .depth_m = -distance,
                                     .area_m2 = search_.share * area_m2,
                                     .bristle_W = Vec3::Zero(),
                                     .id = first | search_.id_bits,
                                     .count = end - first});
  }

  const PlaneContacts& search_;
  std::vector<ContactPoint>& contacts_;
  Eigen::Matrix3d R_WP_;
  Planes all_, planes_;
  boost::container::static_vector<std::pair<const Below*, Four>, kMaxParts> parts_;
  std::size_t first_slices_ = 0;  ///< number of leading entries of parts_ that press on the nearest plane
};

/// Merges all pressing contacts into one, and all contacts with a gap into a second one, if their depths and normals
/// are similar. The result has the same force and moment, and the same stiffness except for rotations about the
/// contact.
///
/// In      begin  index of the first contact to merge; the contacts from it on are consecutive points of a shell
///         must   true: contacts are merged even if they are not similar
void merge_contacts(std::vector<ContactPoint>& contacts, std::size_t begin, double rigid_depth_m, bool must) noexcept {
  if (contacts.size() < begin + 2) return;
  std::array<Mean, 2> sides;
  for (std::size_t i = begin; i < contacts.size(); ++i) sides[contacts[i].depth_m > 0 ? 0 : 1].add(contacts[i]);
  const auto may_merge = [&](const Mean& side) {
    return !(side.area > 0) || (side.is_flat && is_alike(side.low, side.high, rigid_depth_m));
  };
  // The contacts with a gap may be merged at any depths if their area is smaller than that of the pressing contacts.
  const bool has_little_gap = sides[1].is_flat && sides[1].area <= sides[0].area;
  if (!must && !(may_merge(sides[0]) && (has_little_gap || may_merge(sides[1])))) return;
  const std::uint32_t first = contacts[begin].id;
  const std::uint32_t last = contacts.back().id;
  const std::uint32_t end = last + contacts.back().count;
  const bool has_both = sides[0].area > 0 && sides[1].area > 0;
  contacts.resize(begin);
  // If there is both a pressing contact and one with a gap, the latter gets the id of the last point, so that the ids
  // differ.
  if (sides[0].area > 0) contacts.push_back(sides[0].contact(first, has_both ? last : end));
  if (sides[1].area > 0) contacts.push_back(sides[1].contact(has_both ? last : first, end));
}

}  // namespace

void PlaneContacts::add(std::uint32_t root, PlaneSet planes, std::vector<ContactPoint>& contacts) noexcept {
  NodeContacts node_contacts(*this, planes, contacts);
  const auto plane_count = static_cast<std::size_t>(std::popcount(planes));
  const auto more_of = [&](const ShellNode& node) { return (plane_count - 1) * least_contacts_of(node); };
  const std::uint32_t end = shell.nodes[root].next;
  for (std::uint32_t i = root; i < end;) {
    const ShellNode& node = shell.nodes[i];
    const FlatNode& flat = shell.flat_nodes[node.flat];
    const auto [low, high] = node_contacts.depth_range(flat.box_S());
    const std::uint32_t child = i + 1;
    i = node.next;
    // This node may use all remaining contacts except those reserved for later nodes. Contacts that it does not use are
    // available to later nodes.
    room += least_contacts_of(node);
    more -= std::min(more, more_of(node));
    if (high <= -band_m) continue;
    const std::size_t own =
        std::min(room, std::max(least_contacts_of(node) + more_of(node), room - std::min(room, more)));
    const std::size_t begin = contacts.size();
    const bool is_small = node.count <= kSmallNode;
    const bool is_one = is_alike(low, high, rigid_depth_m) && (is_small || node_contacts.has_one_plane());
    if (node.is_leaf || (is_one && is_small)) {
      node_contacts.add_points(node);
      merge_contacts(contacts, begin, rigid_depth_m, own < node.count);
    } else if (!flat.is_polygon() || !node_contacts.add_parts(node, flat, own, true)) {
      std::size_t of_children = 0, more_of_children = 0;
      for (std::uint32_t k = child; k < node.next; k = shell.nodes[k].next) {
        of_children += least_contacts_of(shell.nodes[k]);
        more_of_children += more_of(shell.nodes[k]);
      }
      if (!is_one && own >= of_children + more_of_children) {
        room -= of_children;
        more += more_of_children;
        i = child;
      } else if (is_small) {
        node_contacts.add_points(node);
        merge_contacts(contacts, begin, rigid_depth_m, true);
      } else if (!flat.is_polygon() && flat.has_four_inside() && (low >= 0 || high <= 0) &&
                 node_contacts.has_one_plane()) {
        node_contacts.add_whole(node, flat);
      } else if (!flat.is_polygon() || !node_contacts.add_parts(node, flat, own, false)) {
        node_contacts.add_some_points(node, kMaxNodeContacts);
      }
    }
    room -= std::min(room, contacts.size() - begin);
  }
}

}  // namespace tandem::contact
