#include "lab/studies/contact/mesh_generators.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

namespace tandem::lab {
namespace {

constexpr int kPegSides = 30;
constexpr int kHoleSides = 40;

const Vec3& corner(const geometry::TriangleMesh& mesh, int index) {
  return mesh.vertices[static_cast<std::size_t>(index)];
}

int add_vertex(geometry::TriangleMesh& mesh, const Vec3& p) {
  mesh.vertices.push_back(p);
  return static_cast<int>(mesh.vertices.size()) - 1;
}

/// Adds the vertices of a regular polygon about the z axis, counter-clockwise seen from +z. Returns the index of the
/// first one.
int add_ring(geometry::TriangleMesh& mesh, int sides, double radius_m, double z_m) {
  const int first = static_cast<int>(mesh.vertices.size());
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    mesh.vertices.emplace_back(radius_m * std::cos(angle), radius_m * std::sin(angle), z_m);
  }
  return first;
}

/// Adds the wall between a lower and an upper ring. The wall faces away from the axis.
void join_rings(geometry::TriangleMesh& mesh, int lower, int upper, int sides) {
  for (int i = 0; i < sides; ++i) {
    const int next = (i + 1) % sides;
    mesh.triangles.push_back({lower + i, lower + next, upper + next});
    mesh.triangles.push_back({lower + i, upper + next, upper + i});
  }
}

void cap_ring(geometry::TriangleMesh& mesh, int ring, int sides, double z_m, bool faces_up) {
  const int centre = add_vertex(mesh, Vec3(0, 0, z_m));
  for (int i = 0; i < sides; ++i) {
    const int next = (i + 1) % sides;
    mesh.triangles.push_back(faces_up ? std::array{centre, ring + i, ring + next}
                                      : std::array{centre, ring + next, ring + i});
  }
}

/// Adds the surface between the corners of a square (at 45°, 135°, …) and the ring of the hole inside it. The surface
/// faces +z if `faces_up`, otherwise −z.
void add_annulus(geometry::TriangleMesh& mesh, int ring, int square, bool faces_up) {
  const auto add = [&](int a, int b, int c) {
    mesh.triangles.push_back(faces_up ? std::array{a, b, c} : std::array{a, c, b});
  };
  constexpr int kQuarter = kHoleSides / 4;
  for (int quarter = 0; quarter < 4; ++quarter) {
    for (int i = quarter * kQuarter; i < (quarter + 1) * kQuarter; ++i) {
      add(ring + (i + 1) % kHoleSides, ring + i, square + quarter);
    }
    const int next = (quarter + 1) % 4;
    add(square + quarter, square + next, ring + next * kQuarter);
  }
}

/// Deterministic function of position with values within ±1. Its waves have a length of about 6 mm.
double smooth_noise(const Vec3& p) {
  return std::sin(900 * p.x() + 0.3) * std::sin(1100 * p.y() + 1.1) * std::sin(1000 * p.z() + 2.3);
}

}  // namespace

geometry::TriangleMesh make_peg() {
  geometry::TriangleMesh mesh;
  const double end_m = kPegLength_m / 2;
  const int tip = add_ring(mesh, kPegSides, kPegRadius_m - kPegChamfer_m, -end_m);
  const int shoulder = add_ring(mesh, kPegSides, kPegRadius_m, -end_m + kPegChamfer_m);
  const int top = add_ring(mesh, kPegSides, kPegRadius_m, end_m);
  cap_ring(mesh, tip, kPegSides, -end_m, false);
  join_rings(mesh, tip, shoulder, kPegSides);
  join_rings(mesh, shoulder, top, kPegSides);
  cap_ring(mesh, top, kPegSides, end_m, true);
  return mesh;
}

geometry::TriangleMesh make_box_with_hole(double clearance_m) {
  geometry::TriangleMesh mesh;
  const Vec3 half = Vec3(kBoxWidth_m, kBoxWidth_m, kBoxHeight_m) / 2;
  const double hole_m = (kPegRadius_m + clearance_m) / std::cos(std::numbers::pi / kHoleSides);
  const auto add_square = [&](double z_m) {
    const int first = add_vertex(mesh, Vec3(half.x(), half.y(), z_m));
    add_vertex(mesh, Vec3(-half.x(), half.y(), z_m));
    add_vertex(mesh, Vec3(-half.x(), -half.y(), z_m));
    add_vertex(mesh, Vec3(half.x(), -half.y(), z_m));
    return first;
  };
  const int low_ring = add_ring(mesh, kHoleSides, hole_m, -half.z());
  const int high_ring = add_ring(mesh, kHoleSides, hole_m, half.z());
  const int low_square = add_square(-half.z());
  const int high_square = add_square(half.z());
  join_rings(mesh, low_square, high_square, 4);
  // The rings are passed in reverse order (upper ring first). This reverses the orientation of the wall, so that the
  // hole's wall faces the axis.
  join_rings(mesh, high_ring, low_ring, kHoleSides);
  add_annulus(mesh, high_ring, high_square, true);
  add_annulus(mesh, low_ring, low_square, false);
  return mesh;
}

geometry::TriangleMesh make_sphere(double radius_m, int levels) {
  const double phi = std::numbers::phi;
  geometry::TriangleMesh mesh;
  mesh.vertices = {{-1, phi, 0},  {1, phi, 0},  {-1, -phi, 0}, {1, -phi, 0}, {0, -1, phi},  {0, 1, phi},
                   {0, -1, -phi}, {0, 1, -phi}, {phi, 0, -1},  {phi, 0, 1},  {-phi, 0, -1}, {-phi, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) mesh = subdivided(mesh, 2, 0);
  for (Vec3& vertex : mesh.vertices) vertex *= radius_m / vertex.norm();
  return mesh;
}

geometry::TriangleMesh make_cube(double edge_m) {
  geometry::TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    const auto side = [i, edge_m](int bit) { return ((i >> bit) & 1) != 0 ? edge_m / 2 : -edge_m / 2; };
    mesh.vertices.emplace_back(side(0), side(1), side(2));
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

namespace {

/// Divides every edge and triangle of a mesh. Adjacent triangles share the points on their common edge.
class Subdivision {
 public:
  Subdivision(const geometry::TriangleMesh& mesh, int pieces, double height_m)
      : mesh_(mesh), pieces_(pieces), height_m_(height_m), normals_(mesh.vertices.size(), Vec3::Zero()) {
    result_.vertices = mesh.vertices;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vec3 normal = (corner(mesh, b) - corner(mesh, a)).cross(corner(mesh, c) - corner(mesh, a));
      for (const int i : {a, b, c}) normals_[static_cast<std::size_t>(i)] += normal;
    }
  }

  geometry::TriangleMesh run() {
    for (const auto& triangle : mesh_.triangles) cut(triangle);
    return std::move(result_);
  }

 private:
  /// Divides one triangle with the corners a, b and c. A new point is identified by two numbers: its steps from a
  /// towards b, and its steps from a towards c. Creates these points and the triangles between them.
  void cut(const std::array<int, 3>& triangle) {
    std::map<std::pair<int, int>, int> at;
    for (int to_b = 0; to_b <= pieces_; ++to_b) {
      for (int to_c = 0; to_b + to_c <= pieces_; ++to_c) at[{to_b, to_c}] = point(triangle, to_b, to_c);
    }
    for (int i = 0; i < pieces_; ++i) {
      for (int j = 0; i + j < pieces_; ++j) {
        result_.triangles.push_back({at[{i, j}], at[{i + 1, j}], at[{i, j + 1}]});
        if (i + j + 1 < pieces_) result_.triangles.push_back({at[{i + 1, j}], at[{i + 1, j + 1}], at[{i, j + 1}]});
      }
    }
  }

  int point(const std::array<int, 3>& triangle, int to_b, int to_c) {
    // The corners are sorted, so that both triangles at an edge compute the same key and bit-identical points.
    std::array<std::pair<int, int>, 3> shares{
        {{triangle[0], pieces_ - to_b - to_c}, {triangle[1], to_b}, {triangle[2], to_c}}};
    std::sort(shares.begin(), shares.end());
    Vec3 p = Vec3::Zero(), normal = Vec3::Zero();
    std::vector<int> key;
    for (const auto& [vertex, share] : shares) {
      if (share == 0) continue;
      if (share == pieces_) return vertex;
      key.insert(key.end(), {vertex, share});
      p += corner(mesh_, vertex) * share / pieces_;
      normal += normals_[static_cast<std::size_t>(vertex)] * share;
    }
    const auto [found, is_new] = points_.try_emplace(key, static_cast<int>(result_.vertices.size()));
    if (is_new) result_.vertices.push_back(p + height_m_ * smooth_noise(p) * normal.stableNormalized());
    return found->second;
  }

  const geometry::TriangleMesh& mesh_;
  int pieces_;
  double height_m_;
  std::vector<Vec3> normals_;
  /// indices of the new points; the key contains the corners of the original triangle and their weights in the point
  std::map<std::vector<int>, int> points_;
  geometry::TriangleMesh result_;
};

}  // namespace

geometry::TriangleMesh subdivided(const geometry::TriangleMesh& mesh, int pieces, double height_m) {
  return Subdivision(mesh, pieces, height_m).run();
}

Eigen::AlignedBox3d bounds_of(const geometry::TriangleMesh& mesh) {
  Eigen::AlignedBox3d bounds;
  for (const auto& triangle : mesh.triangles) {
    for (const int index : triangle) bounds.extend(corner(mesh, index));
  }
  return bounds;
}

}  // namespace tandem::lab
