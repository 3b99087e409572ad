#include "common/geometry/repair/mesh_twins.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "common/base/random.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "tests/common/contact/mesh_measures.hpp"
#include "tests/common/contact/test_meshes.hpp"

namespace tandem::geometry {
namespace {

using contact::append;

using Face = std::vector<int>;

/// Polygonal faces, which add_cut() divides into triangles.
struct Faces {
  std::vector<Vec3> vertices;
  std::vector<Face> faces;
};

/// Divides each face into a fan of triangles that meet at the face's corner number `from`, and adds the triangles. If
/// `is_reversed`, they have the opposite orientation.
void add_cut(TriangleMesh& mesh, const Faces& faces, std::size_t from, bool is_reversed) {
  mesh.vertices = faces.vertices;
  for (const Face& face : faces.faces) {
    const std::size_t n = face.size();
    for (std::size_t i = 1; i + 1 < n; ++i) {
      std::array<int, 3> triangle{face[from % n], face[(from + i) % n], face[(from + i + 1) % n]};
      if (is_reversed) std::swap(triangle[1], triangle[2]);
      mesh.triangles.push_back(triangle);
    }
  }
}

TriangleMesh cut(const Faces& faces) {
  TriangleMesh mesh;
  add_cut(mesh, faces, 0, false);
  return mesh;
}

TriangleMesh twice(const Faces& faces, std::size_t from, bool is_reversed) {
  TriangleMesh mesh = cut(faces);
  add_cut(mesh, faces, from, is_reversed);
  return mesh;
}

/// Returns a box with n × n quadrilaterals on each side.
Faces box(int n, const Vec3& size_m = Vec3(0.04, 0.03, 0.02), const Vec3& low_S = Vec3::Zero()) {
  Faces faces;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int end : {0, 1}) {
      const auto first = static_cast<int>(faces.vertices.size());
      for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j) {
          Vec3 p;
          p[axis] = end;
          p[(axis + 1) % 3] = static_cast<double>(i) / n;
          p[(axis + 2) % 3] = static_cast<double>(j) / n;
          faces.vertices.push_back(low_S + p.cwiseProduct(size_m));
          if (i == n || j == n) continue;
          const int at = first + i * (n + 1) + j;
          Face face{at, at + n + 1, at + n + 2, at + 1};
          if (end == 0) std::reverse(face.begin(), face.end());
          faces.faces.push_back(face);
        }
      }
    }
  }
  return faces;
}

/// Returns a torus of twisted quadrilaterals.
Faces torus() {
  constexpr int kAround = 24;
  constexpr int kAcross = 12;
  Faces faces;
  for (int i = 0; i < kAround; ++i) {
    const double a = 2 * std::numbers::pi * i / kAround;
    for (int j = 0; j < kAcross; ++j) {
      const double b = 2 * std::numbers::pi * j / kAcross + 0.4 * std::sin(3 * a);
      const double r = 0.03 + 0.012 * std::cos(b);
      faces.vertices.emplace_back(r * std::cos(a), r * std::sin(a), 0.012 * std::sin(b));
      const int next = (i + 1) % kAround * kAcross;
      const int beside = (j + 1) % kAcross;
      faces.faces.push_back({i * kAcross + j, next + j, next + beside, i * kAcross + beside});
    }
  }
  return faces;
}

Faces prism(int n) {
  Faces faces;
  Face low, high;
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n;
    for (const double z : {0.0, 0.05}) faces.vertices.emplace_back(0.03 * std::cos(angle), 0.03 * std::sin(angle), z);
    const int next = (i + 1) % n;
    faces.faces.push_back({2 * i, 2 * next, 2 * next + 1, 2 * i + 1});
    low.insert(low.begin(), 2 * i);
    high.push_back(2 * i + 1);
  }
  faces.faces.push_back(low);
  faces.faces.push_back(high);
  return faces;
}

Faces wavy_sheet(int n, double height_m) {
  Faces faces;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const double x = static_cast<double>(i) / n;
      const double y = static_cast<double>(j) / n;
      faces.vertices.emplace_back(0.1 * x, 0.1 * y, height_m * std::sin(9 * x) * std::cos(7 * y));
      if (i == n || j == n) continue;
      const int at = i * (n + 1) + j;
      faces.faces.push_back({at, at + n + 1, at + n + 2, at + 1});
    }
  }
  return faces;
}

struct Case {
  std::string name;
  TriangleMesh mesh;
  double volume_m3;  ///< volume of the solid; 0 for a sheet
  double share = 1e-5;
};

std::vector<Case> cases() {
  constexpr double kBox = 0.04 * 0.03 * 0.02;
  std::vector<Case> all;
  for (const bool is_reversed : {true, false}) {
    const std::string way = is_reversed ? ", reversed" : ", same way";
    all.push_back({"box" + way, twice(box(1), 1, is_reversed), kBox});
    all.push_back({"fine box" + way, twice(box(4), 1, is_reversed), kBox});
    // A twisted quadrilateral may be divided along either diagonal, so its volume is known only approximately.
    all.push_back({"torus" + way, twice(torus(), 1, is_reversed), contact::enclosed_m3(cut(torus())), 0.01});
    for (const int n : {5, 24, 64}) {
      const double volume = contact::enclosed_m3(cut(prism(n)));
      all.push_back(
          {"prism " + std::to_string(n) + way, twice(prism(n), static_cast<std::size_t>(n / 3), is_reversed), volume});
    }
    all.push_back({"sheet" + way, twice(wavy_sheet(12, 0.005), 1, is_reversed), 0});
    all.push_back({"flat sheet" + way, twice(wavy_sheet(6, 0), 1, is_reversed), 0});
    TriangleMesh two_ways = cut(box(4));
    append(two_ways, is_reversed ? contact::turned(cut(box(3))) : cut(box(3)));
    all.push_back({"box of 4 and of 3" + way, two_ways, kBox});
    Faces top = box(1);
    top.faces = {top.faces[5]};
    TriangleMesh lidded = cut(box(1));
    TriangleMesh lid;
    add_cut(lid, top, 1, is_reversed);
    append(lidded, lid);
    all.push_back({"box with its top twice" + way, lidded, kBox});
  }
  // One edge of the smaller face lies in the interior of the larger face.
  TriangleMesh joined = cut(box(1));
  append(joined, cut(box(1, Vec3(0.02, 0.03, 0.01), Vec3(0.04, 0, 0))));
  all.push_back({"boxes that share part of a face", joined, kBox + 0.02 * 0.03 * 0.01});
  TriangleMesh stacked = cut(box(1));
  TriangleMesh upper;
  add_cut(upper, box(1, Vec3(0.04, 0.03, 0.01), Vec3(0, 0, 0.02)), 1, false);
  append(stacked, upper);
  all.push_back({"boxes that share a face cut otherwise", stacked, kBox + 0.04 * 0.03 * 0.01});
  return all;
}

/// Returns the mesh as if it were read from a file in single precision: rotated, moved, scaled, and in random order.
TriangleMesh varied(const TriangleMesh& mesh, double scale, Random& random) {
  const auto number = [&] { return random.uniform() - 0.5; };
  const Quat turn = Quat(number(), number(), number(), number()).normalized();
  const Vec3 move(number(), number(), number());
  TriangleMesh other = mesh;
  for (Vec3& p : other.vertices) p = (scale * (turn * p + 0.1 * move)).cast<float>().cast<double>();
  for (std::size_t i = other.triangles.size(); i > 1; --i) {
    std::swap(other.triangles[i - 1], other.triangles[random.next_u32() % i]);
  }
  for (auto& corners : other.triangles) {
    std::rotate(corners.begin(), corners.begin() + random.next_u32() % 3, corners.end());
  }
  return other;
}

void expect_kind(const Case& expected, const TriangleMesh& mesh, double scale) {
  const ContactMesh result = repaired(mesh);
  if (expected.volume_m3 == 0) {
    EXPECT_EQ(result.kind, SurfaceKind::kSheet);
    return;
  }
  EXPECT_EQ(result.kind, SurfaceKind::kSolid);
  EXPECT_TRUE(result.sheet.triangles.empty()) << result.sheet.triangles.size();
  EXPECT_TRUE(contact::is_closed(result.mesh));
  const double volume = contact::enclosed_m3(result.mesh) / std::pow(scale, 3);
  EXPECT_NEAR(volume, expected.volume_m3, expected.share * expected.volume_m3);
}

TEST(MeshTwins, AreTakenOutHoweverTheMeshIsScaledTurnedMovedAndOrdered) {
  Random random(1);
  for (const Case& expected : cases()) {
    SCOPED_TRACE(expected.name);
    expect_kind(expected, expected.mesh, 1);
    for (const double scale : {1.0, 0.001, 1000.0}) {
      for (int i = 0; i < 4; ++i) {
        SCOPED_TRACE("scale " + std::to_string(scale) + ", way " + std::to_string(i));
        expect_kind(expected, varied(expected.mesh, scale, random), scale);
      }
    }
  }
}

TEST(MeshSides, LeaveFacesThatOthersLieOnWhereTheyAre) {
  // A box with an inner wall. The wall has unpaired edges, so the winding number decides for every triangle which of
  // its sides are inside. Two further triangles lie on faces of the box, one in each orientation.
  TriangleMesh mesh = cut(box(2));
  Faces wall;
  for (const double y : {0.0, 0.015, 0.03}) {
    for (const double z : {0.0, 0.01, 0.02}) wall.vertices.emplace_back(0.02, y, z);
  }
  wall.faces = {{0, 1, 4, 3}, {1, 2, 5, 4}, {3, 4, 7, 6}, {4, 5, 8, 7}};
  append(mesh, cut(wall));
  for (const double z : {0.0, 0.02}) {
    append(mesh, {{{0.01, 0.01, z}, {0.03, 0.02, z}, {0.01, 0.025, z}}, {{0, 1, 2}}});
  }
  Random random(2);
  for (const double scale : {1.0, 0.001, 1000.0}) {
    for (int i = 0; i < 8; ++i) {
      SCOPED_TRACE("scale " + std::to_string(scale) + ", way " + std::to_string(i));
      const ContactMesh result = repaired(varied(mesh, scale, random));
      EXPECT_EQ(result.kind, SurfaceKind::kSolid);
      EXPECT_EQ(result.mesh.triangles.size(), 50U);
      EXPECT_TRUE(result.sheet.triangles.empty()) << result.sheet.triangles.size();
    }
  }
}

/// Returns two faces with the same border. One of them has a dent that is `dent_m` deep.
TriangleMesh pillow(double dent_m) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}, {0, 0.1, 0}, {0.05, 0.05, dent_m}};
  mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {0, 2, 1}, {0, 3, 2}};
  return mesh;
}

TEST(MeshTwins, AreNoThinSolids) {
  TriangleMesh plate = cut(box(3, Vec3(0.1, 0.1, 1e-5)));
  EXPECT_EQ(repaired(plate).kind, SurfaceKind::kSolid);
  EXPECT_EQ(repaired(pillow(1e-3)).kind, SurfaceKind::kSolid);
  EXPECT_EQ(repaired(pillow(1e-5)).kind, SurfaceKind::kSolid);
  EXPECT_EQ(repaired(pillow(0)).kind, SurfaceKind::kSheet);
}

TEST(MeshTwins, AreNoPartsOfLargerFaces) {
  // A small box stands on a large one. The floor of the small box lies on the larger face but is no duplicate of it;
  // without its floor the small box would be open.
  TriangleMesh mesh = cut(box(1));
  append(mesh, cut(box(1, Vec3(0.01, 0.01, 0.01), Vec3(0.01, 0.01, 0.02))));
  EXPECT_EQ(drop_twin_patches(mesh, 1e-8), 0U);
  EXPECT_EQ(repaired(mesh).mesh.triangles.size(), 24U);
}

}  // namespace
}  // namespace tandem::geometry
