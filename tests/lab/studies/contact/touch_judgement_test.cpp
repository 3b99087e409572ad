// Tests the evaluation of contact in cases with known results: overlapping boxes, and spheres that pass through walls.
#include "lab/studies/contact/touch_judgement.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>

#include "lab/studies/contact/exact_overlap.hpp"
#include "lab/studies/contact/mesh_generators.hpp"
#include "lab/studies/contact/touch_path.hpp"

namespace tandem::lab {
namespace {

TEST(Quantiles, AreOrderStatisticsOfTheSamples) {
  std::vector<Duration> times;
  for (int i = 1000; i >= 1; --i) times.push_back(std::chrono::microseconds(i));
  const TimeQuantiles quantiles = quantiles_of(times);
  EXPECT_DOUBLE_EQ(quantiles.p50_us, 500);
  EXPECT_DOUBLE_EQ(quantiles.p99_us, 990);
  EXPECT_DOUBLE_EQ(quantiles.p999_us, 999);
  EXPECT_DOUBLE_EQ(quantiles.max_us, 1000);
  EXPECT_DOUBLE_EQ(quantiles_of({}).max_us, 0);
}

TEST(ExactOverlap, TwoCubesFaceToFaceOverlapByTheirDisplacement) {
  const ExactSurface cube(make_cube(0.05));
  // The cube is rotated slightly, so that vertices of one cube lie inside a face of the other cube.
  const Quat turned(Eigen::AngleAxisd(0.3, Vec3::UnitZ()));
  for (const double depth_m : {1e-4, 7e-4, 2.5e-3}) {
    EXPECT_NEAR(deepest_overlap_m(cube, {Vec3(0, 0, 0.05 - depth_m), turned}, cube, Pose{}), depth_m, 1e-12);
  }
  EXPECT_EQ(deepest_overlap_m(cube, {Vec3(0, 0, 0.0501), turned}, cube, Pose{}), 0);
}

TEST(ExactOverlap, SeesCrossedEdgesWhereNoCornerIsInside) {
  const ExactSurface cube(make_cube(0.05));
  // Two edges cross at right angles: both cubes stand on an edge.
  const Quat below(Eigen::AngleAxisd(std::numbers::pi / 4, Vec3::UnitX()));
  const Quat above(Eigen::AngleAxisd(std::numbers::pi / 4, Vec3::UnitY()));
  const double diagonal_m = 0.05 * std::sqrt(0.5);
  const double overlap_m = 1e-3;
  const Pose X_WA{Vec3(0, 0, 2 * diagonal_m - overlap_m), above};
  const double deepest = deepest_overlap_m(cube, X_WA, cube, {Vec3::Zero(), below});
  // The lowest edge of the upper cube is `overlap_m` below the highest edge of the lower cube. The faces at these edges
  // slope by 45°, so the depth is overlap_m · √½, directly at the crossing of the edges. Edge samples are 0.05 mm
  // apart. The nearest one may be 0.025 mm from the crossing, where the depth is smaller.
  EXPECT_LE(deepest, overlap_m * std::sqrt(0.5) + 1e-12);
  EXPECT_GE(deepest, (overlap_m - 2.5e-5) * std::sqrt(0.5));
  EXPECT_FALSE(overlap_points(cube, X_WA, cube, {Vec3::Zero(), below}).empty());
}

TEST(ExactOverlap, DeepestIsThatOfAllPoints) {
  const ExactSurface sphere(make_sphere(0.02, 4)), cube(make_cube(0.05));
  const Pose X_WA{Vec3(0.004, -0.003, 0.0439), Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()))};
  double deepest = 0;
  for (const OverlapPoint& point : overlap_points(sphere, X_WA, cube, Pose{})) {
    deepest = std::max(deepest, point.depth_m);
  }
  EXPECT_GT(deepest, 9e-4);
  EXPECT_EQ(deepest, deepest_overlap_m(sphere, X_WA, cube, Pose{}));
}

geometry::TriangleMesh plate(double thickness_m) {
  geometry::TriangleMesh mesh = make_cube(1);
  for (Vec3& vertex : mesh.vertices) vertex = vertex.cwiseProduct(Vec3(0.1, 0.1, thickness_m));
  return mesh;
}

std::uint64_t events_of_fall(double thickness_m, double to_z_m, double per_step_m) {
  const ExactSurface sphere(make_sphere(0.01, 3)), wall(plate(thickness_m));
  TouchTrace fall;
  for (double z = 0.03; z > to_z_m; z -= per_step_m) fall.emplace_back().X_WT.p.z() = z;
  return figures_of({fall}, sphere, wall).pop_throughs;
}

TEST(PopThrough, CountsASphereThatFallsThroughAThinWallHoweverFast) {
  // In steps of 40 mm, the sphere jumps over the whole wall within one step.
  for (const double per_step_m : {1e-4, 1e-3, 4e-2}) {
    EXPECT_EQ(events_of_fall(2e-3, -0.06, per_step_m), 1U) << per_step_m;
    EXPECT_EQ(events_of_fall(1e-2, -0.06, per_step_m), 1U) << per_step_m;
  }
}

TEST(PopThrough, IsNotCountedForATouchWithinItsBounds) {
  // The sphere falls to a depth of 0.4 mm in a wall of 2 mm, which is permitted.
  EXPECT_EQ(events_of_fall(2e-3, 0.01 + 1e-3 - 4e-4, 1e-4), 0U);
  // The sphere falls to a depth of 2.5 mm in a thick wall. That is too deep, although the sphere is still on the side
  // of entry.
  EXPECT_EQ(events_of_fall(2e-2, 0.01 + 1e-2 - 2.5e-3, 1e-4), 1U);
}

/// Returns a square of 0.2 m without thickness, open on all sides.
geometry::TriangleMesh square() {
  return {{{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0.1, 0.1, 0}, {-0.1, 0.1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
}

TouchFigures evaluated_sheets(const std::vector<Vec3>& way, double per_step_m) {
  const ExactSurface sheet(square(), 5e-4);
  TouchTrace trace;
  for (std::size_t i = 1; i < way.size(); ++i) {
    const double length = (way[i] - way[i - 1]).norm();
    for (double at = 0; at < length; at += per_step_m) {
      trace.emplace_back().X_WT.p = way[i - 1] + (way[i] - way[i - 1]) * (at / length);
    }
  }
  return figures_of({trace}, sheet, sheet);
}

TEST(PopThrough, OfASheetThroughASheetIsCountedOnceHoweverFast) {
  for (const double per_step_m : {1e-4, 1e-3, 4e-2}) {
    EXPECT_EQ(evaluated_sheets({{0, 0, 0.02}, {0, 0, -0.02}, {0, 0, -0.06}}, per_step_m).pop_throughs, 1U)
        << per_step_m;
  }
}

TEST(PopThrough, OfASheetBesideASolidCounts) {
  geometry::TriangleMesh above = square();
  for (Vec3& vertex : above.vertices) vertex.z() += 0.05;
  const auto shelf = std::make_shared<const ExactSurface>(above, 5e-4);
  const ExactSurface body(make_cube(0.05), 0, shelf), sphere(make_sphere(0.01, 3));
  EXPECT_NEAR(body.distance_m(Vec3(0.06, 0, 0.048), 0.1), 0.0015, 1e-9);
  EXPECT_NEAR(body.distance_m(Vec3(0, 0, 0.026), 0.1), 0.001, 1e-9) << "and the solid as before";
  // The sphere falls on the middle of the shelf. It touches the shelf before the cube, and passes through.
  TouchTrace trace;
  for (double z = 0.08; z > 0.0505 + 0.01 - 2e-4; z -= 1e-4) trace.emplace_back().X_WT.p = Vec3(0, 0, z);
  const TouchFigures touch = figures_of({trace}, sphere, body);
  EXPECT_EQ(touch.pop_throughs, 0U);
  EXPECT_GT(touch.max_penetration_m, 0);
  EXPECT_LE(touch.max_penetration_m, 3e-4);
  for (double z = 0.06; z > 0.036; z -= 1e-4) trace.emplace_back().X_WT.p = Vec3(0, 0, z);
  EXPECT_EQ(figures_of({trace}, sphere, body).pop_throughs, 1U);
}

TEST(PopThrough, IsNotThatASheetIsBelowTheOtherHavingGoneAroundItsRim) {
  const TouchFigures figures =
      evaluated_sheets({{0, 0, 0.02}, {0.3, 0, 0.02}, {0.3, 0, -0.02}, {0, 0, -0.02}, {0, 0, -0.0012}}, 1e-3);
  EXPECT_EQ(figures.pop_throughs, 0U);
  EXPECT_EQ(figures.max_penetration_m, 0);
}

TEST(PopThrough, OfSheetsThatTouchPenetrationIsThatOfTheirPlates) {
  const TouchFigures figures = evaluated_sheets({{0, 0, 0.02}, {0, 0, 0.0007}}, 1e-5);
  EXPECT_EQ(figures.pop_throughs, 0U);
  EXPECT_NEAR(figures.max_penetration_m, 3e-4, 2e-5);
}

TEST(TouchPath, BeginsApartTouchesWhereSaidAndIsTheSameTwice) {
  const ExactSurface sphere(make_sphere(0.02, 4)), cube(make_cube(0.05));
  TouchPlan plan;
  plan.press_m = 0.01;
  const devices::HandPath path = touch_path(sphere, cube, plan);
  EXPECT_EQ(path.phases(), (std::vector<std::string>{"approach", "press", "slide", "twist", "pull away"}));
  EXPECT_EQ(deepest_overlap_m(sphere, path.pose_at(Duration{0}), cube, Pose{}), 0);
  EXPECT_NEAR(corner_gap_m(sphere, path.pose_at(Duration{0}), cube, Pose{}), plan.approach_m, 1e-4);
  const Pose at_slide = path.pose_at(begin_of_phase(path, "slide"));
  // The sphere touches the top of the cube at 45 mm, where the phase "press" begins.
  EXPECT_NEAR(at_slide.p.z(), 0.045 - plan.press_m, 1e-4);
  const devices::HandPath again = touch_path(sphere, cube, plan);
  ASSERT_EQ(again.length(), path.length());
  double fastest = 0;
  for (Duration at{0}; at < path.length(); at += std::chrono::milliseconds(1)) {
    EXPECT_EQ(path.pose_at(at).p, again.pose_at(at).p);
    fastest = std::max(fastest, path.twist_at(at).v.norm());
  }
  EXPECT_NEAR(fastest, plan.speed_m_per_s, 1e-3 * plan.speed_m_per_s);
}

}  // namespace
}  // namespace tandem::lab
