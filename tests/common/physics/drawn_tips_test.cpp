// Tests tips on flat surfaces. Without friction, no lateral force may act on a pin, for any triangulation of a mesh.
// With friction, a tip of any size must stick up to Coulomb's limit.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "tests/common/physics/drawn_tips.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::physics {
namespace {

// Largest lateral force, and largest change of the force in a step [N]. In 330 measured scenes, the lateral force was
// at most 0.02 N, except for one with 0.026 N. In that scene, the search does not detect the plane of a face over the
// whole face.
constexpr double kMostDrag_n = 0.03, kMostStep_n = 0.3;
constexpr double kPlateWidth_m = 0.04;

/// A surface with a flat top: `cells`² quadrilaterals with randomly placed inner corners, each split along a random
/// diagonal.
///
/// In      thickness_m  thickness of the plate; 0 gives an open sheet
geometry::TriangleMesh flat_mesh(Random& random, int cells, double thickness_m) {
  geometry::TriangleMesh mesh;
  const auto place = [&](int i) {
    const bool is_inner = i > 0 && i < cells;
    return kPlateWidth_m * ((i + (is_inner ? random.uniform(-0.4, 0.4) : 0)) / cells - 0.5);
  };
  for (int k = 0; k <= cells; ++k) {
    for (int i = 0; i <= cells; ++i) mesh.vertices.emplace_back(place(i), place(k), 0);
  }
  const auto at = [cells](int i, int k) { return k * (cells + 1) + i; };
  for (int k = 0; k < cells; ++k) {
    for (int i = 0; i < cells; ++i) {
      const int a = at(i, k), b = at(i + 1, k), c = at(i + 1, k + 1), d = at(i, k + 1);
      if (random.uniform() < 0.5) {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, d}, {b, c, d}});
      }
    }
  }
  if (thickness_m == 0) return mesh;
  const auto below = static_cast<int>(mesh.vertices.size());
  const std::size_t top = mesh.triangles.size();
  for (int i = 0; i < below; ++i)
    mesh.vertices.push_back(mesh.vertices[static_cast<std::size_t>(i)] - Vec3(0, 0, thickness_m));
  for (std::size_t i = 0; i < top; ++i) {
    const auto [a, b, c] = mesh.triangles[i];
    mesh.triangles.push_back({a + below, c + below, b + below});
  }
  const auto add_wall = [&](int a, int b) {
    mesh.triangles.insert(mesh.triangles.end(), {{b, a, a + below}, {b, a + below, b + below}});
  };
  for (int i = 0; i < cells; ++i) {
    add_wall(at(i, 0), at(i + 1, 0));
    add_wall(at(i + 1, cells), at(i, cells));
    add_wall(at(cells, i), at(cells, i + 1));
    add_wall(at(0, i + 1), at(0, i));
  }
  return mesh;
}

void expect_no_drag(std::uint64_t usual_seed, std::uint64_t usual_scenes) {
  Random random(test::test_seed(usual_seed));
  const double sheet_m = contact::ContactShapeOptions{}.sheet_thickness_m;
  double worst_drag_n = 0, worst_step_n = 0;
  for (std::uint64_t scene = 0; scene < scenes(usual_scenes); ++scene) {
    const int cells = 1 + static_cast<int>(random.next_u32() % 12);
    const double thickness_m = std::array{0.0, 0.002, 0.02}[random.next_u32() % 3];
    const geometry::TriangleMesh mesh = flat_mesh(random, cells, thickness_m);
    const Parts surface = {{mesh_of(mesh), at_place({0, 0, thickness_m == 0 ? -sheet_m / 2 : 0})}};
    Tip tip = tip_of(random);
    while (tip.name.starts_with("ball") || tip.name.starts_with("capsule")) tip = tip_of(random);
    Draw draw;
    draw.press_n = random.uniform(0.5, 5);
    draw.X_WU = at_place({0.1, 0.05, 0.2}, quaternion_of(Vec3(random.normal(), random.normal(), random.normal())));
    const double angle = random.uniform(-3, 3);
    const Vec3 way(0.005 * std::cos(angle), 0.005 * std::sin(angle), 0);
    const Vec3 middle(random.uniform(-0.007, 0.007), random.uniform(-0.007, 0.007), 0);
    draw.from_U = middle - way;
    draw.to_U = middle + way;
    const std::vector<Vec3> forces = drawn(surface, tip, draw);
    double drag_n = 0, step_n = 0;
    // At the start, the damper of the coupling moves the tip along the surface. This motion decays within some tenths
    // of a second, so the first half is skipped.
    for (std::size_t i = forces.size() / 2; i < forces.size(); ++i) {
      drag_n = std::max(drag_n, forces[i].head<2>().norm());
      step_n = std::max(step_n, (forces[i] - forces[i - 1]).norm());
    }
    worst_drag_n = std::max(worst_drag_n, drag_n);
    worst_step_n = std::max(worst_step_n, step_n);
    EXPECT_TRUE(drag_n <= kMostDrag_n && step_n <= kMostStep_n)
        << "scene " << scene << ": " << tip.name << " on a mesh of " << mesh.triangles.size() << " triangles, "
        << thickness_m * 1e3 << " mm thick, pressing with " << draw.press_n << " N: drag " << drag_n << " N, step "
        << step_n << " N";
    EXPECT_NEAR(forces.back().z(), draw.press_n, 0.2 * draw.press_n);
  }
  std::cout << "most drag " << worst_drag_n << " N, step " << worst_step_n << " N\n";
}

void expect_sticking(std::uint64_t usual_seed, std::uint64_t usual_scenes) {
  Random random(test::test_seed(usual_seed));
  const double friction = 0.3;
  double least = 1;
  for (std::uint64_t scene = 0; scene < scenes(usual_scenes); ++scene) {
    const bool is_mesh = random.uniform() < 0.5;
    const Vec3 size_m(0.04, 0.04, 0.02);
    const Parts surface = {{box_of(size_m, is_mesh), at_place({0, 0, -size_m.z() / 2})}};
    const Tip tip = tip_of(random);
    Draw draw;
    // The pressing force is at least 2 N, much more than the 0.2 N with which the coupling's damper pulls while the
    // hand moves.
    draw.press_n = random.uniform(2, 5);
    draw.friction = friction;
    draw.X_WU = at_place({0.1, 0.05, 0.2}, quaternion_of(Vec3(random.normal(), random.normal(), random.normal())));
    const double angle = random.uniform(-3, 3), wanted_n = 0.6 * friction * draw.press_n;
    draw.from_U = Vec3(random.uniform(-0.007, 0.007), random.uniform(-0.007, 0.007), 0);
    draw.hold_steps = 200;
    draw.to_U = draw.from_U + wanted_n / kStiffness_n_per_m * Vec3(std::cos(angle), std::sin(angle), 0);
    const double share = drawn(surface, tip, draw).back().head<2>().norm() / wanted_n;
    least = std::min(least, share);
    // `share` is the fraction of the pull that friction holds. It is below 1, because a tip yields slightly before it
    // sticks. The smallest fraction in 320 scenes was 0.67, for a box of 1 mm.
    EXPECT_GT(share, 0.6) << "scene " << scene << ": " << tip.name << (is_mesh ? " on a mesh" : " on a box")
                          << ", pressing with " << draw.press_n << " N";
  }
  std::cout << "least share of the pull that friction held: " << least << "\n";
}

TEST(Tip, IsNotDraggedByAFlatMesh) {
  expect_no_drag(5, kScenesByDay);
}
TEST(Tip, SticksUpToTheLimitOfFriction) {
  expect_sticking(6, kScenesByDay);
}
TEST(Tip, IsNotDraggedAndSticksInTwoHundredScenes) {
  expect_no_drag(51, kScenesByNight);
  expect_sticking(61, kScenesByNight);
}

}  // namespace
}  // namespace tandem::physics
