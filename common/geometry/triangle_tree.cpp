// Exact distance to a mesh. Building a distance grid takes millions of queries, and most of these are close to the
// previous one. A query therefore first computes the distance to the triangle found last. The search in the tree then
// only verifies that no other triangle is nearer.
#include "common/geometry/triangle_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "common/base/progress.hpp"
#include "common/geometry/closest_on_triangle.hpp"
#include "common/geometry/mesh_edges.hpp"

namespace tandem::geometry {
namespace {

constexpr std::uint32_t kLeafBit = 1U << 31U;
constexpr std::uint32_t kNone = kLeafBit - 1U;
/// Link to a leaf: bits 28 to 30 are the number of its slots − 1, and the lower bits the index of the first slot. A
/// slot is a position in the array of triangles.
constexpr std::uint32_t kCountShift = 28;
constexpr std::uint32_t kSlotMask = (1U << kCountShift) - 1U;
constexpr std::uint32_t kMaxLeafTriangles = 2;
constexpr int kBins = 16;
/// The first kBinnedLevels divisions of the triangles are where the estimated cost of a search is lowest. Deeper
/// divisions halve the number of triangles, which limits the depth of the tree: with at most 2²⁸ slots, there are fewer
/// than 48 + 28 levels of division. A node contains two of these levels.
constexpr int kBinnedLevels = 48;
constexpr int kStackSize = 3 * (48 + 28) / 2 + 8;
constexpr std::uint32_t kMaxInDisk = 256;  ///< largest number of triangles below a child that gets a disk
/// Relative margin for rounding errors in single precision. The distance of a node takes about twelve operations with
/// an error of at most 6e-8 each. In measurements, a margin of 1e-6 sufficed; 4e-6 leaves a reserve.
constexpr double kRounding = 4e-6;
constexpr float kFar = 1e15F;

using Four = Eigen::Array4f;

struct Box {
  Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array3f high = Eigen::Array3f::Constant(-std::numeric_limits<float>::infinity());

  void add(const Box& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }
  void add(const Eigen::Array3f& point) {
    low = low.min(point);
    high = high.max(point);
  }
  /// Returns half the surface area; 0 for an empty box.
  float half_area() const {
    const Eigen::Array3f size = (high - low).max(0.0F);
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
  }
};

float rounded_down(double value) {
  const auto single = static_cast<float>(value);
  return static_cast<double>(single) > value ? std::nextafter(single, -std::numeric_limits<float>::infinity()) : single;
}

float rounded_up(double value) {
  return -rounded_down(-value);
}

Box box_of(const TriangleMesh& mesh, const std::array<int, 3>& triangle) {
  Box box;
  for (const int vertex : triangle) {
    const Vec3& p = mesh.vertices[static_cast<std::size_t>(vertex)];
    Box point;
    point.low = {rounded_down(p.x()), rounded_down(p.y()), rounded_down(p.z())};
    point.high = {rounded_up(p.x()), rounded_up(p.y()), rounded_up(p.z())};
    box.add(point);
  }
  return box;
}

/// Collects the triangles that satisfy `is_it`, in nodes that satisfy `may_be`, up to the size of the span.
/// Out     number of matching triangles; if it exceeds the size of the span, some of them are missing
template <class Nodes, class Corners, class MayBe, class IsIt>
std::size_t gather(const Nodes& nodes, std::uint32_t root, const Corners& corners,
                   const std::vector<std::uint32_t>& triangle_of_slot, const MayBe& may_be, const IsIt& is_it,
                   std::span<TriangleTree::Near> found) noexcept {
  std::array<std::uint32_t, kStackSize> stack;
  std::size_t height = 0;
  stack[height++] = root;
  std::size_t count = 0;
  while (height > 0 && count <= found.size()) {
    const std::uint32_t link = stack[--height];
    if ((link & kLeafBit) == 0) {
      const auto& node = nodes[link];
      const Eigen::Array4i may = may_be(node);
      for (std::size_t i = 0; i < 4 && node.links[i] != kNone; ++i) {
        if (may[static_cast<Eigen::Index>(i)] != 0) stack[height++] = node.links[i];
      }
      continue;
    }
    const std::uint32_t first = link & kSlotMask;
    const std::uint32_t last = first + ((link & ~kLeafBit) >> kCountShift);
    for (std::uint32_t slot = first; slot <= last; ++slot) {
      if (!is_it(corners[slot])) continue;
      const auto& [a, ab, ac] = corners[slot];
      if (count < found.size()) found[count] = {static_cast<int>(triangle_of_slot[slot]), a, ab, ac};
      ++count;
    }
  }
  return count;
}

}  // namespace

/// A node stores up to four children: their links, and their bounding boxes in single precision, rounded outwards. A
/// child with few triangles also has a disk: a flat cylinder around the middle of its box that contains these
/// triangles. On a fine slanted mesh, boxes are much larger than their triangles, but disks are not. A search near the
/// mesh can therefore skip more children.
struct alignas(64) TriangleTree::Node {
  std::array<Four, 3> low = {Four(kFar), Four(kFar), Four(kFar)};
  std::array<Four, 3> high = low;
  std::array<Four, 3> normal = {Four::Zero(), Four::Zero(), Four::Zero()};
  Four half_thickness = Four::Constant(kFar), radius = half_thickness;  ///< size of the child's disk; kFar: no disk
  std::array<std::uint32_t, 4> links = {kNone, kNone, kNone,
                                        kNone};  ///< index of a child; or a leaf: kLeafBit, slots − 1, first slot

  Four middle(std::size_t axis) const { return 0.5F * (low[axis] + high[axis]); }
  /// Returns a lower bound of the squared distance to each child, not counting rounding errors.
  Four least_squared(const Eigen::Array3f& p_S) const noexcept {
    Four to_box = Four::Zero(), to_middle = Four::Zero(), along = Four::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float p = p_S[static_cast<Eigen::Index>(axis)];
      const Four outside = (low[axis] - p).max(p - high[axis]).max(0.0F);
      const Four from_middle = p - middle(axis);
      to_box += outside * outside;
      to_middle += from_middle * from_middle;
      along += from_middle * normal[axis];
    }
    const Four above = (along.abs() - half_thickness).max(0.0F);
    Four beside = ((1 - static_cast<float>(kRounding)) * to_middle - along * along).max(0.0F);
    for (Eigen::Index i = 0; i < 4; ++i) beside[i] = std::sqrt(beside[i]);
    beside = (beside - radius).max(0.0F);
    return to_box.max(above * above + beside * beside);
  }
};

namespace {

/// A query point rounded to single precision, with its rounding error.
struct RoundedPlace {
  explicit RoundedPlace(const Vec3& exact_S)
      : p_S(exact_S.cwiseMax(-kFar).cwiseMin(kFar).cast<float>()),
        off_m((exact_S - p_S.matrix().cast<double>()).norm()) {}

  /// Returns the limit of least_squared() for a search within the distance √squared_m2. If the value of a child exceeds
  /// the limit, none of its triangles is within this distance.
  float limit_m2(double squared_m2) const {
    const double limit_m = (1 + kRounding) * (std::sqrt(squared_m2) + off_m);
    return static_cast<float>(std::min(limit_m * limit_m, static_cast<double>(std::numeric_limits<float>::max())));
  }

  Eigen::Array3f p_S;
  double off_m;
};

}  // namespace

struct TriangleTree::Nearest {
  double squared_m2;
  std::uint32_t slot;
  Vec3 from_a_S;  ///< closest point relative to corner a
  int feature;    ///< part that contains this point: 0: face; 1..3: edges ab, bc, ca; 4..6: corners a, b, c
};

/// Divides the triangles recursively, each time where the surface area heuristic gives the lowest cost of a search.
struct TriangleTree::Builder {
  std::vector<Box> boxes;  ///< bounding box of each triangle
  std::vector<Eigen::Array3f> centres;
  std::vector<std::uint32_t>& order;
  std::vector<Node>& nodes;
  const TriangleMesh& mesh;

  struct Split {
    int axis = 0;
    float low = 0;
    float bins_per_m = 0;
    int first_right_bin = 0;  ///< first bin of the right half; 0: no division was found
  };

  int bin_of(const Split& split, std::uint32_t triangle) const {
    const float bin = (centres[triangle][split.axis] - split.low) * split.bins_per_m;
    return std::clamp(static_cast<int>(bin), 0, kBins - 1);
  }

  Split binned_split(std::span<const std::uint32_t> triangles, const Box& centre_box) const {
    Split split;
    (centre_box.high - centre_box.low).maxCoeff(&split.axis);
    split.low = centre_box.low[split.axis];
    split.bins_per_m = static_cast<float>(kBins) / (centre_box.high[split.axis] - split.low);
    if (!std::isfinite(split.bins_per_m)) return {};
    std::array<Box, kBins> bins;
    std::array<int, kBins> counts{};
    for (const std::uint32_t triangle : triangles) {
      const auto bin = static_cast<std::size_t>(bin_of(split, triangle));
      bins[bin].add(boxes[triangle]);
      ++counts[bin];
    }
    split.first_right_bin = cheapest_border(bins, counts);
    return split;
  }

  static int cheapest_border(const std::array<Box, kBins>& bins, const std::array<int, kBins>& counts) {
    std::array<float, kBins> right_cost{};
    Box right;
    int right_count = 0;
    for (std::size_t i = kBins - 1; i > 0; --i) {
      right.add(bins[i]);
      right_count += counts[i];
      right_cost[i] = right.half_area() * static_cast<float>(right_count);
    }
    const int count = right_count + counts[0];
    Box left;
    int left_count = 0;
    int best = 0;
    float best_cost = std::numeric_limits<float>::infinity();
    for (std::size_t i = 1; i < kBins; ++i) {
      left.add(bins[i - 1]);
      left_count += counts[i - 1];
      const float cost = left.half_area() * static_cast<float>(left_count) + right_cost[i];
      if (left_count > 0 && left_count < count && cost < best_cost) {
        best = static_cast<int>(i);
        best_cost = cost;
      }
    }
    return best;
  }

  std::uint32_t divide(std::uint32_t begin, std::uint32_t end, int level) const {
    if (end - begin > kCallOffEvery) call_off_point();
    const std::span<std::uint32_t> triangles(&order[begin], end - begin);
    if (level < kBinnedLevels) {
      Box centre_box;
      for (const std::uint32_t triangle : triangles) centre_box.add(centres[triangle]);
      if (triangles.size() > kCallOffEvery) call_off_point();
      const Split split = binned_split(triangles, centre_box);
      if (triangles.size() > kCallOffEvery) call_off_point();
      if (split.first_right_bin > 0) {
        const auto middle = std::partition(triangles.begin(), triangles.end(), [&](std::uint32_t triangle) {
          return bin_of(split, triangle) < split.first_right_bin;
        });
        return begin + static_cast<std::uint32_t>(middle - triangles.begin());
      }
    }
    return begin + (end - begin) / 2;
  }

  std::uint32_t subtree(std::uint32_t begin, std::uint32_t end, int level) {
    // The user may cancel the construction at call-off points. Every subtree with at least kCallOffEvery triangles has
    // one. They are thus spread evenly over the work, because the cost of a node is proportional to its triangles.
    if (begin / kCallOffEvery != end / kCallOffEvery) call_off_point();
    if (end - begin <= kMaxLeafTriangles) return kLeafBit | ((end - begin - 1U) << kCountShift) | begin;
    const std::uint32_t middle = divide(begin, end, level);
    const auto halved = [&](std::uint32_t first, std::uint32_t last) {
      return last - first <= kMaxLeafTriangles ? last : divide(first, last, level + 1);
    };
    const std::uint32_t left = halved(begin, middle), right = halved(middle, end);
    const auto index = static_cast<std::uint32_t>(nodes.size());
    nodes.emplace_back();
    std::size_t i = 0;
    for (const auto& [first, last] :
         {std::pair(begin, left), std::pair(left, middle), std::pair(middle, right), std::pair(right, end)}) {
      if (first == last) continue;
      bound(i, std::span(order).subspan(first, last - first), nodes[index]);
      const std::uint32_t link = subtree(first, last, level + 2);
      nodes[index].links[i++] = link;
    }
    return index;
  }

  void bound(std::size_t child, std::span<const std::uint32_t> triangles, Node& node) const {
    const auto i = static_cast<Eigen::Index>(child);
    Box box;
    for (const std::uint32_t triangle : triangles) box.add(boxes[triangle]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      node.low[axis][i] = box.low[static_cast<Eigen::Index>(axis)];
      node.high[axis][i] = box.high[static_cast<Eigen::Index>(axis)];
    }
    if (triangles.size() <= kMaxInDisk) lay_disk(i, triangles, node);
  }

  void lay_disk(Eigen::Index i, std::span<const std::uint32_t> triangles, Node& node) const {
    Vec3 normal = Vec3::Zero();
    for (const std::uint32_t triangle : triangles) normal += doubled_area(mesh, triangle);
    if (!(normal.norm() > 0)) return;
    // The normal is lengthened by a margin, so that its length is at least 1 after rounding to single precision.
    normal *= (1 + kRounding / 8) / normal.norm();
    Vec3 middle;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      node.normal[axis][i] = static_cast<float>(normal[static_cast<Eigen::Index>(axis)]);
      middle[static_cast<Eigen::Index>(axis)] = static_cast<double>(node.middle(axis)[i]);
    }
    double radius_m2 = 0, half_thickness_m = 0;
    for (const std::uint32_t triangle : triangles) {
      for (const Vec3& corner : corners_of(mesh, triangle)) {
        const Vec3 from_middle = corner - middle;
        const double along_m = from_middle.dot(normal);
        half_thickness_m = std::max(half_thickness_m, std::abs(along_m));
        radius_m2 = std::max(radius_m2, (from_middle - along_m * normal).squaredNorm());
      }
    }
    const double rounding_m = kRounding * (half_thickness_m + std::sqrt(radius_m2));
    node.half_thickness[i] = static_cast<float>(half_thickness_m + rounding_m);
    node.radius[i] = static_cast<float>(std::sqrt(radius_m2) + rounding_m);
  }
};

TriangleTree::TriangleTree(TriangleTree&& other) noexcept = default;
TriangleTree& TriangleTree::operator=(TriangleTree&& other) noexcept = default;
TriangleTree::~TriangleTree() = default;

TriangleTree::TriangleTree(const TriangleMesh& mesh) {
  if (mesh.triangles.empty() || mesh.triangles.size() > kSlotMask) {
    throw std::invalid_argument("a triangle tree needs 1 to " + std::to_string(kSlotMask) +
                                " triangles, the mesh has " + std::to_string(mesh.triangles.size()));
  }
  build_nodes(mesh);
  store_triangles(mesh);
  sum_corner_normals(mesh);
  sum_edge_normals(mesh);
}

void TriangleTree::build_nodes(const TriangleMesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  triangle_of_slot_.resize(count);
  std::iota(triangle_of_slot_.begin(), triangle_of_slot_.end(), 0U);
  nodes_.reserve(count / 2 + 1);
  Builder builder{{}, {}, triangle_of_slot_, nodes_, mesh};
  builder.boxes.reserve(count);
  builder.centres.reserve(count);
  for (const auto& triangle : mesh.triangles) {
    call_off_point(builder.boxes.size());
    builder.boxes.push_back(box_of(mesh, triangle));
    builder.centres.emplace_back((builder.boxes.back().low + builder.boxes.back().high) * 0.5F);
  }
  root_ = builder.subtree(0, static_cast<std::uint32_t>(count), 0);
  nodes_.shrink_to_fit();
}

void TriangleTree::store_triangles(const TriangleMesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  corners_.reserve(count);
  vertices_of_slot_.reserve(count);
  slot_of_triangle_.resize(count);
  for (std::size_t slot = 0; slot < count; ++slot) {
    call_off_point(slot);
    const std::uint32_t triangle = triangle_of_slot_[slot];
    slot_of_triangle_[triangle] = static_cast<std::uint32_t>(slot);
    const auto& ids = mesh.triangles[triangle];
    const std::array<std::uint32_t, 3> vertices = {
        static_cast<std::uint32_t>(ids[0]), static_cast<std::uint32_t>(ids[1]), static_cast<std::uint32_t>(ids[2])};
    vertices_of_slot_.push_back(vertices);
    const Vec3& a = mesh.vertices[vertices[0]];
    corners_.push_back({a, mesh.vertices[vertices[1]] - a, mesh.vertices[vertices[2]] - a});
  }
}

bool TriangleTree::try_triangle(std::uint32_t slot, const Vec3& p_S, Nearest& best) const noexcept {
  const auto& [a, ab, ac] = corners_[slot];
  const Vec3 ap = p_S - a;
  const OnTriangle on = closest_on_triangle(ab, ac, ap);
  const double squared = (ap - on.from_a).squaredNorm();
  if (!(squared < best.squared_m2)) return false;
  best = {squared, slot, on.from_a, on.feature};
  return true;
}

void TriangleTree::descend(const Vec3& p_S, Nearest& best) const noexcept {
  struct Entry {
    std::uint32_t link;
    float squared_m2;
  };
  std::array<Entry, kStackSize> stack;
  std::size_t height = 0;
  const RoundedPlace p(p_S);
  stack[height++] = {root_, 0};
  float limit_m2 = p.limit_m2(best.squared_m2);
  while (height > 0) {
    const auto [link, squared_m2] = stack[--height];
    if (squared_m2 > limit_m2) continue;
    if ((link & kLeafBit) != 0) {
      const std::uint32_t first = link & kSlotMask;
      const std::uint32_t last = first + ((link & ~kLeafBit) >> kCountShift);
      for (std::uint32_t slot = first; slot <= last; ++slot) {
        if (try_triangle(slot, p_S, best)) limit_m2 = p.limit_m2(best.squared_m2);
      }
      continue;
    }
    const Node& node = nodes_[link];
    const Four squared = node.least_squared(p.p_S);
    // Children are pushed in the order of decreasing distance, so the nearest one is on top of the stack.
    const std::size_t before = height;
    for (std::size_t i = 0; i < 4 && node.links[i] != kNone; ++i) {
      const Entry entry{node.links[i], squared[static_cast<Eigen::Index>(i)]};
      if (entry.squared_m2 > limit_m2) continue;
      std::size_t at = height++;
      for (; at > before && stack[at - 1].squared_m2 < entry.squared_m2; --at) stack[at] = stack[at - 1];
      stack[at] = entry;
    }
  }
}

TriangleTree::Closest TriangleTree::closest(const Vec3& p_S, double limit_m, int hint) const noexcept {
  if (!p_S.allFinite()) return {};
  Nearest best{limit_m * limit_m, kNone, Vec3::Zero(), 0};
  if (hint >= 0 && static_cast<std::size_t>(hint) < slot_of_triangle_.size()) {
    try_triangle(slot_of_triangle_[static_cast<std::size_t>(hint)], p_S, best);
  }
  descend(p_S, best);
  if (best.slot == kNone) return {};
  Closest closest;
  closest.point_S = corners_[best.slot][0] + best.from_a_S;
  closest.distance_m = std::sqrt(best.squared_m2);
  closest.triangle = static_cast<int>(triangle_of_slot_[best.slot]);
  closest.normal_S = pseudo_normal(best.slot, best.feature);
  return closest;
}

std::size_t TriangleTree::within(const Vec3& p_S, double limit_m, std::span<Near> found) const noexcept {
  const double squared_limit = limit_m * limit_m;
  const RoundedPlace p(p_S);
  const float rounded_limit = p.limit_m2(squared_limit);
  const auto may_be_in = [&](const Node& node) {
    return Eigen::Array4i((node.least_squared(p.p_S) <= rounded_limit).cast<int>());
  };
  const auto is_in = [&](const std::array<Vec3, 3>& corners) {
    const auto& [a, ab, ac] = corners;
    const Vec3 ap = p_S - a;
    return (ap - closest_on_triangle(ab, ac, ap).from_a).squaredNorm() <= squared_limit;
  };
  return gather(nodes_, root_, corners_, triangle_of_slot_, may_be_in, is_in, found);
}

std::size_t TriangleTree::within(const Eigen::AlignedBox3d& box_S, std::span<Near> found) const noexcept {
  std::array<float, 3> low, high;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = rounded_down(box_S.min()[static_cast<Eigen::Index>(axis)]);
    high[axis] = rounded_up(box_S.max()[static_cast<Eigen::Index>(axis)]);
  }
  const auto may_be_in = [&](const Node& node) {
    Four apart = Four::Constant(-kFar);
    for (std::size_t axis = 0; axis < 3; ++axis)
      apart = apart.max(node.low[axis] - high[axis]).max(low[axis] - node.high[axis]);
    return Eigen::Array4i((apart <= 0).cast<int>());
  };
  const auto is_in = [&](const std::array<Vec3, 3>& corners) {
    const auto& [a, ab, ac] = corners;
    const Eigen::AlignedBox3d box(a + ab.cwiseMin(ac).cwiseMin(0.0), a + ab.cwiseMax(ac).cwiseMax(0.0));
    return box_S.intersects(box);
  };
  return gather(nodes_, root_, corners_, triangle_of_slot_, may_be_in, is_in, found);
}

/// Separating-axis test: a box and a line do not meet if an axis exists along which their projections do not overlap.
/// The axes to test are the cross products of the line's direction with the coordinate axes.
bool TriangleTree::may_cross(const Node& node, Eigen::Index child, const Vec3& p_S, const Vec3& along) noexcept {
  const auto corner = [child](const std::array<Four, 3>& of) { return Vec3(of[0][child], of[1][child], of[2][child]); };
  const Vec3 low = corner(node.low), high = corner(node.high);
  const Vec3 half = (high - low) / 2;
  const Vec3 apart = ((low + high) / 2 - p_S).cross(along).cwiseAbs();
  const Vec3 d = along.cwiseAbs();
  constexpr double kRoundedUp = 1 + 1e-9;
  const Vec3 reach(half.y() * d.z() + half.z() * d.y(), half.z() * d.x() + half.x() * d.z(),
                   half.x() * d.y() + half.y() * d.x());
  return (apart.array() <= kRoundedUp * reach.array()).all();
}

std::size_t TriangleTree::crossed(const Vec3& p_S, const Vec3& along, std::span<Near> found) const noexcept {
  const auto may_be_crossed = [&](const Node& node) {
    Eigen::Array4i may;
    for (Eigen::Index i = 0; i < 4; ++i) may[i] = may_cross(node, i, p_S, along) ? 1 : 0;
    return may;
  };
  // A line crosses a triangle if it passes all three sides with the same sense of rotation about the line.
  const auto is_crossed = [&](const std::array<Vec3, 3>& corners) {
    const auto& [a, ab, ac] = corners;
    const Vec3 pa = a - p_S, pb = pa + ab, pc = pa + ac;
    const double sides[] = {along.dot(pa.cross(pb)), along.dot(pb.cross(pc)), along.dot(pc.cross(pa))};
    const auto [least, most] = std::minmax({sides[0], sides[1], sides[2]});
    return !((least < 0 && most > 0) || along.dot(ab.cross(ac)) == 0);
  };
  return gather(nodes_, root_, corners_, triangle_of_slot_, may_be_crossed, is_crossed, found);
}

}  // namespace tandem::geometry
