// A distance grid asks for millions of closest points, most of them next to the last one: so a query starts with the
// distance to the triangle of its neighbour, and the tree only has to prove that nothing is nearer.
#include "common/geometry/triangle_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "common/geometry/closest_on_triangle.hpp"

namespace tandem::geometry {
namespace {

constexpr std::uint32_t kLeafBit = 1U << 31U;
constexpr std::uint32_t kCountShift = 28;  ///< three bits of slots − 1, above 28 bits of first slot
constexpr std::uint32_t kSlotMask = (1U << kCountShift) - 1U;
constexpr std::uint32_t kMaxLeafTriangles = 4;
constexpr int kBins = 16;
/// Deeper, triangles are halved by count: with 28 bits of slots, a tree has less than 48 + 28 levels.
constexpr int kBinnedLevels = 48;
constexpr int kStackSize = 80;

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
  /// Half the surface; 0 of an empty box.
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

/// The triangles for which `is_it` says so, below nodes of which `may_be` does, as many as the span holds.
/// Out     how many; more than the span holds: there are others
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
      for (const auto& child : nodes[link].children) {
        if (may_be(child)) stack[height++] = child.link;
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

/// Of one child: a box in single precision, rounded outward, and where it goes on.
struct TriangleTree::Child {
  std::array<float, 3> low;
  std::array<float, 3> high;
  std::uint32_t link = 0;  ///< a node, or kLeafBit | slots − 1 in the next bits | first slot
};

struct TriangleTree::Node {
  std::array<Child, 2> children;
};

struct TriangleTree::Corners {
  Vec3 a, ab, ac;
};

struct TriangleTree::Nearest {
  double squared_m2;
  std::uint32_t slot;
  Vec3 from_a_S;  ///< closest point − corner a
  int feature;    ///< 0 face, 1..3 edges ab, bc, ca, 4..6 corners a, b, c
};

/// Splits the triangles from the root down, each time where the surface area heuristic expects the fewest visits.
struct TriangleTree::Builder {
  std::vector<Box> boxes;  ///< of the mesh's triangles
  std::vector<Eigen::Array3f> centres;
  std::vector<std::uint32_t>& order;
  std::vector<Node>& nodes;

  struct Split {
    int axis = 0;
    float low = 0;
    float bins_per_m = 0;
    int first_right_bin = 0;  ///< 0: no split found
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
    const std::span<std::uint32_t> triangles(&order[begin], end - begin);
    if (level < kBinnedLevels) {
      Box centre_box;
      for (const std::uint32_t triangle : triangles) centre_box.add(centres[triangle]);
      const Split split = binned_split(triangles, centre_box);
      if (split.first_right_bin > 0) {
        const auto middle = std::partition(triangles.begin(), triangles.end(), [&](std::uint32_t triangle) {
          return bin_of(split, triangle) < split.first_right_bin;
        });
        return begin + static_cast<std::uint32_t>(middle - triangles.begin());
      }
    }
    return begin + (end - begin) / 2;
  }

  Child child(std::uint32_t begin, std::uint32_t end, int level) {
    Box box;
    for (std::uint32_t i = begin; i < end; ++i) box.add(boxes[order[i]]);
    Child result;
    for (int axis = 0; axis < 3; ++axis) {
      result.low[static_cast<std::size_t>(axis)] = box.low[axis];
      result.high[static_cast<std::size_t>(axis)] = box.high[axis];
    }
    result.link = subtree(begin, end, level);
    return result;
  }

  std::uint32_t subtree(std::uint32_t begin, std::uint32_t end, int level) {
    if (end - begin <= kMaxLeafTriangles) return kLeafBit | ((end - begin - 1U) << kCountShift) | begin;
    const std::uint32_t middle = divide(begin, end, level);
    const auto index = static_cast<std::uint32_t>(nodes.size());
    nodes.emplace_back();
    const Child left = child(begin, middle, level + 1);
    const Child right = child(middle, end, level + 1);
    nodes[index].children = {left, right};
    return index;
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
  Builder builder{{}, {}, triangle_of_slot_, nodes_};
  builder.boxes.reserve(count);
  builder.centres.reserve(count);
  for (const auto& triangle : mesh.triangles) {
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

void TriangleTree::sum_corner_normals(const TriangleMesh& mesh) {
  vertex_normals_.assign(mesh.vertices.size(), Vec3::Zero());
  const auto angle = [](const Vec3& u, const Vec3& v) { return std::atan2(u.cross(v).norm(), u.dot(v)); };
  for (std::size_t slot = 0; slot < corners_.size(); ++slot) {
    const auto& [a, ab, ac] = corners_[slot];
    const Vec3 bc = ac - ab;
    const Vec3 normal = ab.cross(ac).normalized();
    const auto& vertices = vertices_of_slot_[slot];
    vertex_normals_[vertices[0]] += angle(ab, ac) * normal;
    vertex_normals_[vertices[1]] += angle(-ab, bc) * normal;
    vertex_normals_[vertices[2]] += angle(ac, bc) * normal;
  }
}

void TriangleTree::sum_edge_normals(const TriangleMesh& mesh) {
  // Edges are sought among those that leave the same smaller vertex: about three, whatever the size of the mesh.
  struct Edge {
    std::uint32_t larger_vertex;
    std::uint32_t next;  ///< of the same smaller vertex
  };
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> first_edge(mesh.vertices.size(), kNone);
  std::vector<Edge> edges;
  edges.reserve(corners_.size() * 3 / 2);
  edge_normals_.reserve(edges.capacity());
  edges_of_slot_.resize(corners_.size());
  for (std::size_t slot = 0; slot < corners_.size(); ++slot) {
    const Vec3 normal = corners_[slot].ab.cross(corners_[slot].ac).normalized();
    for (std::size_t side = 0; side < 3; ++side) {
      const auto [from, to] = std::minmax(vertices_of_slot_[slot][side], vertices_of_slot_[slot][(side + 1) % 3]);
      std::uint32_t edge = first_edge[from];
      while (edge != kNone && edges[edge].larger_vertex != to) edge = edges[edge].next;
      if (edge == kNone) {
        edge = static_cast<std::uint32_t>(edges.size());
        edges.push_back({to, first_edge[from]});
        first_edge[from] = edge;
        edge_normals_.emplace_back(Vec3::Zero());
      }
      edge_normals_[edge] += normal;
      edges_of_slot_[slot][side] = edge;
    }
  }
}

double TriangleTree::squared_to_box(const Child& child, const Vec3& p_S) const noexcept {
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double p = p_S[static_cast<Eigen::Index>(axis)];
    const double outside =
        std::max(std::max(static_cast<double>(child.low[axis]) - p, 0.0), p - static_cast<double>(child.high[axis]));
    sum += outside * outside;
  }
  return sum;
}

void TriangleTree::try_triangle(std::uint32_t slot, const Vec3& p_S, Nearest& best) const noexcept {
  const Corners& corners = corners_[slot];
  const Vec3 ap = p_S - corners.a;
  const OnTriangle on = closest_on_triangle(corners.ab, corners.ac, ap);
  const double squared = (ap - on.from_a).squaredNorm();
  if (squared < best.squared_m2) best = {squared, slot, on.from_a, on.feature};
}

void TriangleTree::descend(const Vec3& p_S, Nearest& best) const noexcept {
  struct Entry {
    std::uint32_t link;
    double squared_m2;
  };
  std::array<Entry, kStackSize> stack;
  std::size_t height = 0;
  std::uint32_t link = root_;
  while (true) {
    if ((link & kLeafBit) != 0) {
      const std::uint32_t first = link & kSlotMask;
      const std::uint32_t last = first + ((link & ~kLeafBit) >> kCountShift);
      for (std::uint32_t slot = first; slot <= last; ++slot) try_triangle(slot, p_S, best);
    } else {
      const auto& children = nodes_[link].children;
      const double squared0 = squared_to_box(children[0], p_S);
      const double squared1 = squared_to_box(children[1], p_S);
      const std::size_t near = squared1 < squared0 ? 1 : 0;
      const double far_squared = std::max(squared0, squared1);
      if (far_squared < best.squared_m2) stack[height++] = {children[1 - near].link, far_squared};
      if (std::min(squared0, squared1) < best.squared_m2) {
        link = children[near].link;
        continue;
      }
    }
    while (height > 0 && stack[height - 1].squared_m2 >= best.squared_m2) --height;
    if (height == 0) return;
    link = stack[--height].link;
  }
}

Vec3 TriangleTree::pseudo_normal(std::uint32_t slot, int feature) const noexcept {
  if (feature == 0) return corners_[slot].ab.cross(corners_[slot].ac).normalized();
  if (feature <= 3) return edge_normals_[edges_of_slot_[slot][static_cast<std::size_t>(feature - 1)]];
  return vertex_normals_[vertices_of_slot_[slot][static_cast<std::size_t>(feature - 4)]];
}

TriangleTree::Closest TriangleTree::closest(const Vec3& p_S, double limit_m, int hint) const noexcept {
  constexpr std::uint32_t kNone = ~0U;
  Nearest best{limit_m * limit_m, kNone, Vec3::Zero(), 0};
  if (hint >= 0 && static_cast<std::size_t>(hint) < slot_of_triangle_.size()) {
    try_triangle(slot_of_triangle_[static_cast<std::size_t>(hint)], p_S, best);
  }
  descend(p_S, best);
  if (best.slot == kNone) return {};
  Closest closest;
  closest.point_S = corners_[best.slot].a + best.from_a_S;
  closest.distance_m = std::sqrt(best.squared_m2);
  closest.triangle = static_cast<int>(triangle_of_slot_[best.slot]);
  closest.normal_S = pseudo_normal(best.slot, best.feature);
  return closest;
}

std::size_t TriangleTree::within(const Vec3& p_S, double limit_m, std::span<Near> found) const noexcept {
  const double squared_limit = limit_m * limit_m;
  const auto may_be_in = [&](const Child& child) { return squared_to_box(child, p_S) <= squared_limit; };
  const auto is_in = [&](const Corners& corners) {
    const Vec3 ap = p_S - corners.a;
    return (ap - closest_on_triangle(corners.ab, corners.ac, ap).from_a).squaredNorm() <= squared_limit;
  };
  return gather(nodes_, root_, corners_, triangle_of_slot_, may_be_in, is_in, found);
}

std::size_t TriangleTree::within(const Eigen::AlignedBox3d& box_S, std::span<Near> found) const noexcept {
  const auto may_be_in = [&](const Child& child) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      if (child.low[axis] > box_S.max()[i] || child.high[axis] < box_S.min()[i]) return false;
    }
    return true;
  };
  const auto is_in = [&](const Corners& corners) {
    const auto& [a, ab, ac] = corners;
    const Eigen::AlignedBox3d box(a + ab.cwiseMin(ac).cwiseMin(0.0), a + ab.cwiseMax(ac).cwiseMax(0.0));
    return box_S.intersects(box);
  };
  return gather(nodes_, root_, corners_, triangle_of_slot_, may_be_in, is_in, found);
}

/// Box and line are apart if they are, seen along the line and an axis, for one of the axes.
bool TriangleTree::may_cross(const Child& child, const Vec3& p_S, const Vec3& along) noexcept {
  const Vec3 low(child.low[0], child.low[1], child.low[2]), high(child.high[0], child.high[1], child.high[2]);
  const Vec3 half = (high - low) / 2;
  const Vec3 apart = ((low + high) / 2 - p_S).cross(along).cwiseAbs();
  const Vec3 d = along.cwiseAbs();
  constexpr double kRounding = 1 + 1e-9;
  const Vec3 reach(half.y() * d.z() + half.z() * d.y(), half.z() * d.x() + half.x() * d.z(),
                   half.x() * d.y() + half.y() * d.x());
  return (apart.array() <= kRounding * reach.array()).all();
}

std::size_t TriangleTree::crossed(const Vec3& p_S, const Vec3& along, std::span<Near> found) const noexcept {
  const auto may_be_crossed = [&](const Child& child) { return may_cross(child, p_S, along); };
  // The line passes all three sides on the same hand.
  const auto is_crossed = [&](const Corners& corners) {
    const auto& [a, ab, ac] = corners;
    const Vec3 pa = a - p_S, pb = pa + ab, pc = pa + ac;
    const double sides[] = {along.dot(pa.cross(pb)), along.dot(pb.cross(pc)), along.dot(pc.cross(pa))};
    const auto [least, most] = std::minmax({sides[0], sides[1], sides[2]});
    return !((least < 0 && most > 0) || along.dot(ab.cross(ac)) == 0);
  };
  return gather(nodes_, root_, corners_, triangle_of_slot_, may_be_crossed, is_crossed, found);
}

}  // namespace tandem::geometry
