#include "common/geometry/mesh_edges.hpp"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <unordered_map>

namespace tandem::geometry {

EdgeUses::EdgeUses(const TriangleMesh& mesh) {
  struct Use {
    std::uint64_t edge;
    std::uint32_t half;
    bool operator<(const Use& other) const { return edge != other.edge ? edge < other.edge : half < other.half; }
  };
  std::vector<Use> sorted;
  sorted.reserve(mesh.triangles.size() * 3);
  for (std::size_t triangle = 0; triangle < mesh.triangles.size(); ++triangle) {
    for (std::size_t side = 0; side < 3; ++side) {
      const auto a = static_cast<std::uint64_t>(mesh.triangles[triangle][side]);
      const auto b = static_cast<std::uint64_t>(mesh.triangles[triangle][(side + 1) % 3]);
      sorted.push_back({std::min(a, b) << 32U | std::max(a, b), static_cast<std::uint32_t>(3 * triangle + side)});
    }
  }
  std::sort(sorted.begin(), sorted.end());
  uses_.reserve(sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (i == 0 || sorted[i].edge != sorted[i - 1].edge) starts_.push_back(i);
    uses_.push_back({static_cast<int>(sorted[i].half / 3), static_cast<int>(sorted[i].half % 3)});
  }
  starts_.push_back(uses_.size());
}

std::vector<MeshEdge> mesh_edges(const TriangleMesh& mesh) {
  const EdgeUses edges(mesh);
  std::vector<MeshEdge> found;
  found.reserve(edges.edge_count());
  for (std::size_t edge = 0; edge < edges.edge_count(); ++edge) {
    const auto uses = edges.uses(edge);
    for (std::size_t i = 0; i < uses.size(); i += 2) {
      const int right = i + 1 < uses.size() ? uses[i + 1].triangle : -1;
      found.push_back({start_of(mesh, uses[i]), end_of(mesh, uses[i]), uses[i].triangle, right});
    }
  }
  return found;
}

std::vector<std::vector<int>> regions_by_edges(const TriangleMesh& mesh,
                                               std::span<const std::array<std::uint32_t, 3>> edges,
                                               const std::vector<bool>& is_one_of_them) {
  constexpr int kNone = -1, kMany = -2;
  std::uint32_t most = 0;
  for (const auto& of_triangle : edges) most = std::max(most, *std::ranges::max_element(of_triangle));
  const HalfEdge none{kNone, 0};
  std::vector<std::array<HalfEdge, 2>> at_edge(std::size_t{most} + 1, {none, none});
  for (std::size_t t = 0; t < edges.size(); ++t) {
    for (std::size_t side = 0; side < 3; ++side) {
      auto& [one, other] = at_edge[edges[t][side]];
      const HalfEdge half{static_cast<int>(t), static_cast<int>(side)};
      if (one.triangle == kNone) {
        one = half;
      } else {
        other = other.triangle == kNone ? half : HalfEdge{kMany, 0};
      }
    }
  }
  std::vector<bool> is_reached(edges.size(), false);
  std::vector<std::vector<int>> regions;
  for (std::size_t first = 0; first < edges.size(); ++first) {
    if (is_reached[first] || !is_one_of_them[first]) continue;
    std::vector<int>& region = regions.emplace_back();
    const auto reach = [&](int triangle) {
      const auto t = static_cast<std::size_t>(triangle);
      if (is_reached[t] || !is_one_of_them[t]) return;
      is_reached[t] = true;
      region.push_back(triangle);
    };
    reach(static_cast<int>(first));
    for (std::size_t i = 0; i < region.size(); ++i) {
      for (const std::uint32_t edge : edges[static_cast<std::size_t>(region[i])]) {
        const auto& [one, other] = at_edge[edge];
        if (other.triangle < 0 || start_of(mesh, one) == start_of(mesh, other)) continue;
        reach(one.triangle);
        reach(other.triangle);
      }
    }
  }
  return regions;
}

TriangleMesh part_of(const TriangleMesh& mesh, std::span<const int> triangles) {
  constexpr std::size_t kFew = 64;
  const bool is_small = kFew * triangles.size() < mesh.vertices.size();
  std::vector<int> all(is_small ? 0 : mesh.vertices.size(), -1);
  std::unordered_map<int, int> some;
  TriangleMesh part;
  for (const int t : triangles) {
    part.triangles.push_back(mesh.triangles[static_cast<std::size_t>(t)]);
    for (int& corner : part.triangles.back()) {
      int& index = is_small ? some.try_emplace(corner, -1).first->second : all[static_cast<std::size_t>(corner)];
      if (index < 0) {
        index = static_cast<int>(part.vertices.size());
        part.vertices.push_back(mesh.vertices[static_cast<std::size_t>(corner)]);
      }
      corner = index;
    }
  }
  return part;
}

std::array<Vec3, 3> corners_of(const TriangleMesh& mesh, std::size_t triangle) {
  const auto at = [&](std::size_t k) { return mesh.vertices[static_cast<std::size_t>(mesh.triangles[triangle][k])]; };
  return {at(0), at(1), at(2)};
}

std::vector<Vec3> face_normals(const TriangleMesh& mesh) {
  std::vector<Vec3> normals;
  normals.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) normals.push_back(doubled_area(mesh, i).stableNormalized());
  return normals;
}

std::vector<Vec3> vertex_normals(const TriangleMesh& mesh, const std::vector<Vec3>& normals) {
  std::vector<Vec3> sums(mesh.vertices.size(), Vec3::Zero());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto at = static_cast<std::size_t>(mesh.triangles[i][corner]);
      const Vec3& p = mesh.vertices[at];
      const Vec3 u = mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][(corner + 1) % 3])] - p;
      const Vec3 v = mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][(corner + 2) % 3])] - p;
      sums[at] += std::atan2(u.cross(v).norm(), u.dot(v)) * normals[i];
    }
  }
  // If the normals of opposite faces cancel out, their sum is only a rounding error with a random direction. Zero is
  // returned instead.
  for (Vec3& sum : sums) sum = sum.norm() > 1e-9 ? Vec3(sum.normalized()) : Vec3(Vec3::Zero());
  return sums;
}

std::vector<std::size_t> parts_by_vertices(const TriangleMesh& mesh) {
  std::vector<int> above(mesh.vertices.size());
  std::iota(above.begin(), above.end(), 0);
  const auto root = [&above](int vertex) {
    while (above[static_cast<std::size_t>(vertex)] != vertex) {
      int& up = above[static_cast<std::size_t>(vertex)];
      vertex = up = above[static_cast<std::size_t>(up)];
    }
    return static_cast<std::size_t>(vertex);
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    above[root(b)] = static_cast<int>(root(a));
    above[root(c)] = static_cast<int>(root(a));
  }
  constexpr std::size_t kNone = ~std::size_t{0};
  std::vector<std::size_t> number(mesh.vertices.size(), kNone), parts;
  std::size_t count = 0;
  parts.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    std::size_t& part = number[root(triangle[0])];
    if (part == kNone) part = count++;
    parts.push_back(part);
  }
  return parts;
}

double volume_m3(const TriangleMesh& mesh) {
  double volume = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    volume += (mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][0])] - mesh.vertices.front())
                  .dot(doubled_area(mesh, t)) /
              6;
  }
  return volume;
}

double area_m2(const TriangleMesh& mesh) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) area += doubled_area(mesh, t).norm() / 2;
  return area;
}

}  // namespace tandem::geometry
