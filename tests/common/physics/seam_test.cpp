// Tests contact with a union of shapes. When a tool slides over the seam between flush shapes, its force must be the
// same as on a single shape.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <limits>
#include <numbers>
#include <string>

#include "tests/common/physics/drawn_tips.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::physics {
namespace {

/// Size of a box. Its points are so far apart that contacts come from the points of the tip only.
constexpr double kWidth_m = 0.1, kHeight_m = 0.02;
// Largest permitted lateral force beyond friction. In 700 scenes with other seeds, the largest was 0.02 N.
constexpr double kMost_n = 0.05;

/// The same surface at z = 0 in two versions: one shape, and several flush shapes.
struct Surface {
  std::string name;
  Parts one, several;
  /// Largest force with which the tip is pressed. On a ridge of the radius R, a tip that is beside the crest by an
  /// offset is pushed sideways by force · offset / R. A coupling with the stiffness k holds the tip only if the force
  /// is below k R.
  double most_press_n = 5;
};

/// Returns boxes side by side along x, in some scenes also along y. If `has_meshes`, random boxes are meshes; otherwise
/// all are primitives.
Surface boxes(Random& random, bool has_meshes) {
  Surface surface{has_meshes ? "meshes" : "boxes", {}, {}};
  surface.one = {{box_of({2 * kWidth_m, kWidth_m, kHeight_m}, has_meshes), at_place({0, 0, -kHeight_m / 2})}};
  const bool has_four = random.uniform() < 0.3;
  const double all_share = has_meshes ? (random.uniform() < 0.5 ? 1 : 0.5) : 0;
  const auto add = [&](double width_m, const Vec3& middle) {
    const bool is_mesh = random.uniform() < all_share;
    surface.several.push_back({box_of({kWidth_m, width_m, kHeight_m}, is_mesh), at_place(middle)});
    surface.name += is_mesh ? ", mesh" : ", box";
  };
  for (const double x : {-0.5, 0.5}) {
    if (has_four) {
      for (const double y : {-0.25, 0.25}) add(kWidth_m / 2, {x * kWidth_m, y * kWidth_m, -kHeight_m / 2});
    } else {
      add(kWidth_m, {x * kWidth_m, 0, -kHeight_m / 2});
    }
  }
  return surface;
}

/// Returns overlapping boxes, or a box with a cylinder inside whose end is flush with the top of the box.
Surface overlapping(Random& random) {
  Surface surface{"overlapping", {}, {}};
  surface.one = {{box_of({2 * kWidth_m, kWidth_m, kHeight_m}, false), at_place({0, 0, -kHeight_m / 2})}};
  if (random.uniform() < 0.5) {
    surface.several = surface.one;
    surface.several.push_back({rod_of(0.006, kHeight_m, false), at_place({0, 0, -kHeight_m / 2})});
  } else {
    const double over_m = 0.004;
    for (const double x : {-0.5, 0.5}) {
      surface.several.push_back({box_of({kWidth_m + over_m, kWidth_m, kHeight_m}, false),
                                 at_place({x * (kWidth_m - over_m), 0, -kHeight_m / 2})});
    }
  }
  return surface;
}

/// Returns rods that are joined end to end along x.
Surface rods(Random& random) {
  const double radius_m = random.uniform() < 0.5 ? 0.008 : 0.02;
  const Quat along_x(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY()));
  Surface surface{"rods", {}, {}, 0.6 * kStiffness_n_per_m * radius_m};
  surface.one = {{rod_of(radius_m, 2 * kWidth_m, false), at_place({0, 0, -radius_m}, along_x)}};
  for (const double x : {-0.5, 0.5}) {
    surface.several.push_back({rod_of(radius_m, kWidth_m, false), at_place({x * kWidth_m, 0, -radius_m}, along_x)});
  }
  return surface;
}

/// Returns the lateral force that the seam adds.
/// - Without friction: the largest lateral difference between simultaneous forces on several shapes and on one shape.
/// - With friction, sticking depends on the past. The result is the excess of the lateral force on several shapes over
///   a limit: the largest lateral force on one shape, or the friction force if that is larger.
double sideways_apart_n(const std::vector<Vec3>& one, const std::vector<Vec3>& several, double friction) {
  double usual = 0, most = 0;
  for (const Vec3& f : one) usual = std::max(usual, f.head<2>().norm());
  for (std::size_t i = 0; i < several.size(); ++i) {
    const Vec3& f = several[i];
    most = std::max(
        most, friction > 0 ? f.head<2>().norm() - std::max(usual, friction * f.z()) : (f - one[i]).head<2>().norm());
  }
  return most;
}

/// Returns the smallest normal force along the path.
double least_lift_n(const std::vector<Vec3>& forces) {
  double least = std::numeric_limits<double>::infinity();
  for (const Vec3& f : forces) least = std::min(least, f.z());
  return least;
}

void expect_no_catch(std::uint64_t usual_seed, std::uint64_t usual_scenes,
                     const std::function<Surface(Random&)>& make) {
  Random random(test::test_seed(usual_seed));
  double worst = 0;
  for (std::uint64_t i = 0; i < scenes(usual_scenes); ++i) {
    const Surface surface = make(random);
    const Tip tip = tip_of(random);
    const bool is_round = surface.name.starts_with("rods");
    Draw draw;
    draw.press_n = random.uniform(0.5, std::min(5.0, surface.most_press_n));
    draw.friction = random.uniform() < 0.3 ? 0.3 : 0;
    draw.is_of_bodies = random.uniform() < 0.5;
    draw.X_WU = at_place({0.1, 0.05, 0.2}, quaternion_of(Vec3(random.normal(), random.normal(), random.normal())));
    const double angle = is_round ? 0 : random.uniform(-1, 1);
    const Vec3 way(0.004 * std::cos(angle), 0.004 * std::sin(angle), 0);
    const Vec3 middle(0, is_round ? 0 : random.uniform(-0.0005, 0.0005), 0);
    draw.from_U = middle - way;
    draw.to_U = middle + way;
    const std::vector<Vec3> on_one = drawn(surface.one, tip, draw), on_several = drawn(surface.several, tip, draw);
    const double apart_n = sideways_apart_n(on_one, on_several, draw.friction);
    EXPECT_GT(least_lift_n(on_several), 0.8 * draw.press_n)
        << "scene " << i << ": the surface carries the tip all the way";
    worst = std::max(worst, apart_n);
    EXPECT_LE(apart_n, kMost_n) << "scene " << i << ": " << tip.name << " on " << surface.name
                                << (draw.is_of_bodies ? " (bodies)" : "") << ", pressing with " << draw.press_n
                                << " N, friction " << draw.friction << ", angle " << angle;
  }
  std::cout << "largest difference: " << worst << " N\n";
}

Surface of_boxes(Random& random) {
  return boxes(random, false);
}
Surface of_meshes(Random& random) {
  return boxes(random, true);
}

TEST(Seam, OfBoxesIsNotFelt) {
  expect_no_catch(1, kScenesByDay, of_boxes);
}
TEST(Seam, OfMeshesIsNotFelt) {
  expect_no_catch(2, kScenesByDay, of_meshes);
}
TEST(Seam, OfShapesThatOverlapIsNotFelt) {
  expect_no_catch(3, kScenesByDay, overlapping);
}
TEST(Seam, OfRodsEndToEndIsNotFelt) {
  expect_no_catch(4, kScenesByDay, rods);
}
TEST(Seam, IsNotFeltInTwoHundredScenesOfEachKind) {
  expect_no_catch(15, kScenesByNight, of_boxes);
  expect_no_catch(16, kScenesByNight, of_meshes);
  expect_no_catch(17, kScenesByNight, overlapping);
  expect_no_catch(18, kScenesByNight, rods);
}

}  // namespace
}  // namespace tandem::physics
