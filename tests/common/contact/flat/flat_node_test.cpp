#include "common/contact/points/flat_node.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <tuple>

#include "common/contact/contact_shape.hpp"
#include "common/contact/points/flat_points.hpp"
#include "common/contact/points/polygon.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "tests/common/contact/hand_made_shell.hpp"
#include "tests/common/contact/test_meshes.hpp"

namespace tandem::contact {
namespace {

TEST(FlatNode, ItsFourPointsHaveItsAreaMeanAndCovariance) {
  const PointShell shell = PointShell::make(box_points(Vec3(0.03, 0.02, 0.01), 5e-4), 5e-4);
  std::size_t checked = 0, polygons = 0;
  for (const ShellNode& node : shell.nodes) {
    if (node.flat == ShellNode::kNotFlat) continue;
    const FlatNode& flat = shell.flat_nodes[node.flat];
    Vec3 mean = Vec3::Zero();
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    double area = 0;
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Vec3 p = shell.points[i].p_S.cast<double>();
      area += shell.points[i].area_m2;
      mean += shell.points[i].area_m2 * p;
      square += shell.points[i].area_m2 * p * p.transpose();
      const OrientedBox box = flat.box_S();
      EXPECT_TRUE(((box.axes.transpose() * (p - box.centre)).cwiseAbs().array() <= box.half_m.array() + 1e-8).all());
    }
    mean /= area;
    const Eigen::Matrix3d covariance = square / area - mean * mean.transpose();
    Eigen::Matrix3d of_four = Eigen::Matrix3d::Zero();
    for (const auto& [axis, deviation] :
         {std::pair(flat.along_S, flat.deviation_along_m), std::pair(flat.across_S, flat.deviation_across_m)}) {
      of_four += deviation * deviation * axis.cast<double>() * axis.cast<double>().transpose();
    }
    // A polygon only approximates the outline, so its moments may be wrong by a few per cent.
    const double extent_m = flat.half_m.norm();
    EXPECT_NEAR((flat.mean_S.cast<double>() - mean).norm(), 0, flat.is_polygon() ? 0.06 * extent_m : 1e-8);
    EXPECT_NEAR((of_four - covariance).norm(), 0, (flat.is_polygon() ? 0.15 : 1e-5) * covariance.trace() + 1e-12);
    checked += node.is_leaf ? 0 : 1;
    polygons += flat.is_polygon() ? 1 : 0;
  }
  EXPECT_GT(checked, 100U);
  EXPECT_GT(polygons, 20U);
}

TEST(FlatNode, IsAPolygonOnlyIfItIsCoveredEvenly) {
  const auto root_of = [](const std::vector<Vec3>& places) {
    std::vector<ShellPoint> points;
    for (const Vec3& p : places) points.push_back({p.cast<float>(), Eigen::Vector3f::UnitZ(), 1e-7F});
    const PointShell shell = PointShell::make(std::move(points), 5e-4);
    EXPECT_NE(shell.nodes.at(0).flat, ShellNode::kNotFlat);
    return shell.flat_nodes.at(shell.nodes.at(0).flat);
  };
  const Quat turn(Eigen::AngleAxisd(0.4, Vec3::UnitZ()));
  std::vector<Vec3> face, face_with_hole, two_sides, triangle, notched, line;
  for (int i = 0; i < 40; ++i) {
    line.push_back(turn * Vec3(4e-4 * i, 0, 0));
    two_sides.push_back(turn * Vec3(4e-4 * i, 0, 0));
    two_sides.push_back(turn * Vec3(0, 4e-4 * (i + 1), 0));
    for (int k = 0; k < 30; ++k) {
      face.push_back(turn * Vec3(4e-4 * i, 4e-4 * k, 0));
      const bool is_in_hole = i >= 22 && i < 26 && k >= 17 && k < 21;
      if (!is_in_hole) face_with_hole.push_back(face.back());
    }
    for (int k = 0; k < 30; ++k) {
      if (i < 15 || i >= 25 || k < 15) notched.push_back(turn * Vec3(4e-4 * i, 4e-4 * k, 0));
    }
    for (int k = 0; k < i; ++k) triangle.push_back(turn * Vec3(4e-4 * i, 4e-4 * k, 0));
  }
  EXPECT_EQ(root_of(face).corner_count, 4U);
  EXPECT_NEAR(root_of(face).half_m.head<2>().maxCoeff(), 19.5 * 4e-4, 5e-6);
  EXPECT_NEAR(root_of(face).half_m.head<2>().minCoeff(), 14.5 * 4e-4, 5e-6);
  EXPECT_EQ(root_of(line).corner_count, 4U);
  EXPECT_FALSE(root_of(face_with_hole).is_polygon()) << "its mean and deviations are a rectangle's, about";
  EXPECT_FALSE(root_of(two_sides).is_polygon()) << "projected on its axes it looks like one";
  EXPECT_FALSE(root_of(notched).is_polygon()) << "it is not convex";
  EXPECT_EQ(root_of(triangle).corner_count, 3U);
}

// For outlines with 3 to 8 sides, the polygon must have nearly the area, mean and covariance of its points, and contain
// almost all of them.
TEST(FlatNode, APolygonHasTheMomentsOfItsPoints) {
  for (const int sides : {3, 5, 6, 7, 8}) {
    std::vector<ShellPoint> points;
    std::mt19937 random(static_cast<unsigned>(sides));
    std::uniform_real_distribution<double> jitter(-5e-5, 5e-5);
    constexpr double kInner_m = 0.01, kSpacing_m = 2.5e-4;
    for (int i = -80; i <= 80; ++i) {
      for (int k = -80; k <= 80; ++k) {
        const Eigen::Vector2d p(kSpacing_m * i + jitter(random), kSpacing_m * k + jitter(random));
        bool is_in = true;
        for (int side = 0; side < sides; ++side) {
          const double angle = 2 * std::numbers::pi * side / sides + 0.1;
          is_in = is_in && p.dot(Eigen::Vector2d(std::cos(angle), std::sin(angle))) < kInner_m;
        }
        const Vec3 p_S(p.x(), p.y(), 0.003);
        if (is_in) points.push_back({p_S.cast<float>(), Eigen::Vector3f::UnitZ(), 1.6e-7F});
      }
    }
    const PointShell shell = PointShell::make(std::move(points), kSpacing_m);
    const ShellNode& root = shell.nodes.at(0);
    ASSERT_NE(root.flat, ShellNode::kNotFlat);
    const FlatNode& flat = shell.flat_nodes.at(root.flat);
    ASSERT_TRUE(flat.is_polygon()) << sides << " sides";
    EXPECT_GE(flat.corner_count, static_cast<std::uint32_t>(sides));
    const Moments moments = moments_of(shell.points);
    const AreaMoments sum = moments_of(corners_of(flat));
    const double exact_m2 = sides * std::tan(std::numbers::pi / sides) * kInner_m * kInner_m;
    EXPECT_NEAR(sum(0, 0) / exact_m2, 1, 0.02) << sides << " sides";
    EXPECT_NEAR((flat.mean_S.cast<double>() - moments.mean).norm(), 0, 1e-8);
    EXPECT_NEAR(mean_of(sum).norm(), 0, 1e-7);
    Eigen::Matrix<double, 3, 2> axes;
    axes << flat.along_S.cast<double>(), flat.across_S.cast<double>();
    const Eigen::Matrix2d covariance = axes.transpose() * moments.covariance * axes;
    EXPECT_NEAR((covariance_of(sum) - covariance).norm() / covariance.norm(), 0, 1e-4) << sides << " sides";
    for (const Eigen::Vector2d& corner : corners_of(flat)) {
      const Vec3 p_S = flat.mean_S.cast<double>() + axes * corner;
      const OrientedBox box = flat.box_S();
      EXPECT_TRUE(((box.axes.transpose() * (p_S - box.centre)).cwiseAbs().array() <= box.half_m.array() + 1e-7).all());
      EXPECT_LE(p_S.head<2>().norm(), kInner_m / std::cos(std::numbers::pi / sides) + 1.5e-4);
    }
  }
}

TEST(FlatNode, ItsPolygonLiesOnTheSurface) {
  // Fails if a polygon extends beyond the surface. The prisms are critical cases:
  // - Five sides: edges of one plane have different directions.
  // - 8 and 32 sides: corners of flat nodes are near the rim of the end face.
  for (const auto& [sides, radius_m, height_m] :
       {std::tuple(5, 0.0526, 0.0657), std::tuple(8, 0.05, 0.0625), std::tuple(32, 0.0375, 0.1)}) {
    const geometry::TriangleMesh mesh = prism_mesh(sides, radius_m, height_m);
    const auto shape = make_contact_mesh({mesh, geometry::SurfaceKind::kSolid, {}});
    const geometry::TriangleTree exact(mesh);
    double farthest_m = 0;
    std::size_t polygons = 0, with_more_corners = 0;
    for (const PointShell* shell : {&shape->shells.surface, &shape->shells.features}) {
      for (const FlatNode& flat : shell->flat_nodes) {
        polygons += flat.is_polygon() ? 1 : 0;
        with_more_corners += flat.corner_count > 4 ? 1 : 0;
        for (std::uint32_t i = 0; i < flat.corner_count; ++i) {
          const Vec3 corner_S =
              (flat.mean_S + flat.along_S * flat.corners_m[i].x() + flat.across_S * flat.corners_m[i].y())
                  .cast<double>();
          farthest_m = std::max(farthest_m, exact.closest(corner_S).distance_m);
        }
      }
    }
    EXPECT_GT(polygons, 1000U);
    EXPECT_GT(with_more_corners, 20U);
    EXPECT_LE(farthest_m, 1.3e-4) << sides << " sides";
  }
}

TEST(FlatRuns, PointsOfAFaceAndOfAnEdgeFollowEachOther) {
  const PointShell shell = PointShell::make(box_points(Vec3(0.03, 0.02, 0.01), 5e-4), 5e-4);
  // The polygons together must represent most of the area of the box.
  double area_m2 = 0;
  for (std::size_t i = 0; i < shell.nodes.size();) {
    const ShellNode& node = shell.nodes[i];
    const bool is_polygon = node.flat != ShellNode::kNotFlat && shell.flat_nodes[node.flat].is_polygon();
    if (is_polygon) area_m2 += node.mean.area_m2;
    i = is_polygon ? node.next : i + 1;
  }
  EXPECT_GT(area_m2, 0.8 * shell.area_m2());
}

}  // namespace
}  // namespace tandem::contact
