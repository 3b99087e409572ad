// Tests the search and the solver together, with shapes whose contact has a closed form.
#include <gtest/gtest.h>

#include "common/contact/contact_reduction.hpp"
#include "tests/common/contact/mesh_measures.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/common/contact/touch_rig.hpp"

namespace tandem::contact {
namespace {

constexpr double kTouchClosedFormStiffness = 5e9;
constexpr double kBand_m = 2e-4;
const double kOneDegree = std::numbers::pi / 180;

struct Touch {
  ShapePointer a, b;
  Pose X_WA;
  Vec3 direction_W = Vec3::UnitZ();  ///< direction in which A is pushed
  double depth_m = 0;
  double angle_rad = kOneDegree;
  double error_m = 0;  ///< deviation of the triangle mesh from the ideal shape
};

std::vector<ContactPoint> contacts_of(const ContactShape& a, const ContactShape& b, const Pose& X_WA) {
  ContactPair pair;
  pair.bind(&a, &b);
  pair.find(X_WA, {}, kBand_m);
  return {pair.contacts().begin(), pair.contacts().end()};
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

void expect_depth_and_direction(const Touch& touch, const std::string& what) {
  const auto contacts = contacts_of(*touch.a, *touch.b, touch.X_WA);
  ASSERT_FALSE(contacts.empty()) << what;
  double deepest_m = -1;
  for (const ContactPoint& c : contacts) deepest_m = std::max(deepest_m, c.depth_m);
  EXPECT_NEAR(deepest_m, touch.depth_m, 0.02 * touch.a->shells.surface.spacing_m + touch.error_m) << what;
  const Vec3 force = contact_wrench(contacts, kTouchClosedFormStiffness, touch.X_WA.p).on_a_W.f;
  EXPECT_LT(angle_between(force, touch.direction_W), touch.angle_rad) << what;
}

/// Rotations of the shapes. They change the position of the lattice of samples relative to curved surfaces, so that
/// errors at any position are detected.
const std::vector<Vec3>& turns() {
  static const std::vector<Vec3> all = {{0, 0, 0}, {0.3, 0, 0}, {0, 1.1, 0.4}, {1, 2, 3}, {-0.7, 0.9, 0.2}};
  return all;
}

/// Returns the force of a plane on a ball that penetrates it by `depth_m`: ∫ k (d − r²/2R) 2πr dr over the cap.
double cap_force_n(double radius_m, double depth_m) {
  return kTouchClosedFormStiffness * std::numbers::pi * radius_m * depth_m * depth_m;
}

void expect_ball_on_floor(const ShapePointer& ball, const ShapePointer& floor, double floor_top_m, double error_m,
                          const std::string& what, double field_error_m = 0) {
  const double radius_m = 0.02;
  for (const double depth_m : {1e-4, 2e-4, 4e-4}) {
    for (const Vec3& turn : turns()) {
      const Pose X_WA{{0.0011, -0.0007, floor_top_m + radius_m - depth_m}, quaternion_of(turn)};
      const std::string at = what + " at depth " + std::to_string(depth_m * 1e3) + " mm";
      expect_depth_and_direction({ball, floor, X_WA, Vec3::UnitZ(), depth_m, kOneDegree, error_m}, at);
      const auto contacts = contacts_of(*ball, *floor, X_WA);
      const double force_n = contact_wrench(contacts, kTouchClosedFormStiffness, Vec3::Zero()).on_a_W.f.norm();
      const double formula_n = cap_force_n(radius_m, depth_m);
      EXPECT_NEAR(force_n, formula_n, (0.03 + 2 * field_error_m / depth_m) * formula_n) << at;
    }
  }
}

TEST(TouchClosedForm, ABallOnAPlaneIsPushedAlongItsNormalByStiffnessTimesPiRadiusDepthSquared) {
  const ShapePointer ball = make_contact_sphere(0.02);
  const ShapePointer large = make_contact_box({0.4, 0.4, 0.05});
  const ShapePointer small = make_contact_box({0.03, 0.03, 0.01});
  expect_ball_on_floor(ball, large, 0.025, 0, "large floor");
  expect_ball_on_floor(ball, small, 0.005, 0, "finely sampled floor");
  expect_ball_on_floor(ball, solid_of(box_mesh({0.03, 0.03, 0.01})), 0.005, 0, "mesh floor");
}

TEST(TouchClosedForm, ABallOfTrianglesIsAsGoodAsTheFormula) {
  const double radius_m = 0.02;
  geometry::TriangleMesh mesh = sphere_mesh(radius_m, 6);
  // The facets are inside the sphere through their corners. The mesh is therefore scaled to the volume of the sphere.
  const double larger = radius_m / std::cbrt(enclosed_m3(mesh) * 0.75 / std::numbers::pi);
  for (Vec3& vertex : mesh.vertices) vertex *= larger;
  // After scaling, the centre of a facet is as far inside the sphere as its corners are outside.
  const double edge_rad = std::numbers::pi / 2 / 64;
  const double facet_error_m = radius_m * edge_rad * edge_rad / 4;
  const ShapePointer ball = solid_of(mesh);
  // The floor's points sample the ball's grid. Its cells of 0.8 mm cause an interpolation error, because the surface is
  // curved in two directions.
  const double interpolation_error_m = 2 * 8e-4 * 8e-4 / (8 * radius_m);
  expect_ball_on_floor(ball, make_contact_box({0.4, 0.4, 0.05}), 0.025, facet_error_m, "large floor");
  expect_ball_on_floor(ball, solid_of(box_mesh({0.03, 0.03, 0.01})), 0.005, facet_error_m, "mesh floor",
                       interpolation_error_m);
}

constexpr int kBoreCorners = 512;

/// A tube along z.
geometry::TriangleMesh tube_mesh(double bore_m, double outer_m, double length_m) {
  geometry::TriangleMesh mesh;
  for (int i = 0; i < kBoreCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kBoreCorners;
    const Vec3 out(std::cos(angle), std::sin(angle), 0);
    for (const double z : {-length_m / 2, length_m / 2}) {
      mesh.vertices.push_back(bore_m * out + z * Vec3::UnitZ());
      mesh.vertices.push_back(outer_m * out + z * Vec3::UnitZ());
    }
  }
  // Each angle has four vertices of the cross-section: bore low, outer low, bore high, outer high.
  for (int i = 0; i < kBoreCorners; ++i) {
    const int a = 4 * i;
    const int b = 4 * ((i + 1) % kBoreCorners);
    for (const auto& [from, to] : {std::pair(1, 3), std::pair(3, 2), std::pair(2, 0), std::pair(0, 1)}) {
      mesh.triangles.push_back({a + from, b + from, b + to});
      mesh.triangles.push_back({a + from, b + to, a + to});
    }
  }
  return mesh;
}

TEST(TouchClosedForm, ABallInABoreIsPushedTowardsTheAxis) {
  const double bore_m = 0.02;
  const double radius_m = 0.012;
  const double facet_error_m = bore_m * (1 - std::cos(std::numbers::pi / kBoreCorners));
  const ShapePointer tube = solid_of(tube_mesh(bore_m, 0.026, 0.05));
  const ShapePointer ball = make_contact_sphere(radius_m);
  for (const double angle : {0.0, 0.4, 1.3, 2.9, 4.4}) {
    for (const double depth_m : {1e-4, 3e-4}) {
      const Vec3 out(std::cos(angle), std::sin(angle), 0);
      const Pose X_WA{(bore_m - radius_m + depth_m) * out + Vec3(0, 0, 0.003), quaternion_of({1, angle, 0})};
      expect_depth_and_direction({ball, tube, X_WA, -out, depth_m, kOneDegree, facet_error_m},
                                 "at " + std::to_string(angle) + " rad, depth " + std::to_string(depth_m * 1e3));
    }
  }
}

TEST(TouchClosedForm, AnEdgeOnAPlaneIsPushedAlongThePlanesNormal) {
  const ShapePointer box = make_contact_box({0.02, 0.02, 0.02});
  const ShapePointer mesh_box = solid_of(box_mesh({0.02, 0.02, 0.02}));
  const ShapePointer large = make_contact_box({0.4, 0.4, 0.05});
  const ShapePointer mesh_floor = solid_of(box_mesh({0.05, 0.05, 0.01}));
  for (const double tilt_deg : {30.0, 45.0, 70.0}) {
    for (const double depth_m : {5e-5, 2e-4}) {
      const double tilt = tilt_deg * kOneDegree;
      const double reach_m = 0.01 * (std::sin(tilt) + std::cos(tilt));
      const Quat q = quaternion_of({0, 0, 0.3}) * quaternion_of({tilt, 0, 0});
      const std::string what = std::to_string(tilt_deg) + " deg, depth " + std::to_string(depth_m * 1e3) + " mm";
      const auto above = [&](double top_m) { return Pose{{0, 0, top_m + reach_m - depth_m}, q}; };
      expect_depth_and_direction({box, large, above(0.025), Vec3::UnitZ(), depth_m}, what + ", box");
      expect_depth_and_direction({mesh_box, large, above(0.025), Vec3::UnitZ(), depth_m}, what + ", mesh");
      // Tolerance of the force's direction. The floor's points also press, and the nearest face of the box pushes them
      // obliquely. Their lateral forces do not exceed those of the box's points. A wedge that is 50 µm deep has only
      // few points, so its error is larger.
      const double angle = (depth_m < 1e-4 ? 4.5 : 1.5) * kOneDegree;
      expect_depth_and_direction({mesh_box, mesh_floor, above(0.005), Vec3::UnitZ(), depth_m, angle},
                                 what + ", two meshes");
    }
  }
}

/// Returns the derivative from central differences of the search: A is displaced by ± 1 µm and rotated by ± 10 µrad.
Mat6 searched_derivative(const ContactShape& a, const ContactShape& b, const Pose& X_WA) {
  Mat6 derivative;
  for (int axis = 0; axis < 6; ++axis) {
    const double step = axis < 3 ? 1e-6 : 1e-5;
    Vec6 change = Vec6::Zero();
    for (const double sign : {1.0, -1.0}) {
      Pose moved = X_WA;
      if (axis < 3) moved.p[axis] += sign * step;
      if (axis >= 3) moved.q = quaternion_of(sign * step * Vec3::Unit(axis - 3)) * X_WA.q;
      const Wrench wrench = contact_wrench(contacts_of(a, b, moved), kTouchClosedFormStiffness, X_WA.p).on_a_W;
      change.head<3>() += sign * wrench.f;
      change.tail<3>() += sign * wrench.t;
    }
    derivative.col(axis) = change / (2 * step);
  }
  return derivative;
}

/// Returns the relative error of the reported derivative, with lengths in units of `unit_m`.
double derivative_error(const ContactShape& a, const ContactShape& b, const Pose& X_WA, double unit_m,
                        const Vec3& moved_along = Vec3::Ones()) {
  Vec6 scale;
  scale << moved_along, 1 / unit_m, 1 / unit_m, 1 / unit_m;
  const Mat6 stated = contact_wrench(contacts_of(a, b, X_WA), kTouchClosedFormStiffness, X_WA.p).derivative;
  const Mat6 searched = searched_derivative(a, b, X_WA);
  return (scale.asDiagonal() * (stated - searched) * scale.asDiagonal()).norm() /
         (scale.asDiagonal() * searched * scale.asDiagonal()).norm();
}

TEST(TouchDerivative, IsThatOfTheSearchForABallAndAnEdgeOnAPlane) {
  const ShapePointer ball = make_contact_sphere(0.02);
  const ShapePointer box = make_contact_box({0.02, 0.02, 0.02});
  const ShapePointer floor = make_contact_box({0.4, 0.4, 0.05});
  const ShapePointer mesh_floor = solid_of(box_mesh({0.03, 0.03, 0.05}));
  const Quat q = quaternion_of({std::numbers::pi / 4, 0, 0});
  for (const ShapePointer& below : {floor, mesh_floor}) {
    for (const double depth_m : {1e-4, 3e-4}) {
      EXPECT_LT(derivative_error(*ball, *below, {{0, 0, 0.045 - depth_m}, q}, 0.02), 0.1) << depth_m;
      const double edge_m = 0.025 + 0.01 * std::sqrt(2.0) - depth_m;
      // The derivative of single contacts omits two effects of an edge that moves sideways or rotates. The pressed
      // region of the floor moves with the edge, and the floor's points change their depth at the crease.
      const Vec3 moved_along = below == floor ? Vec3(Vec3::Ones()) : Vec3(1, 0, 1);
      EXPECT_LT(derivative_error(*box, *below, {{0, 0, edge_m}, q}, 0.02, moved_along), below == floor ? 0.1 : 0.2)
          << depth_m;
    }
  }
}

}  // namespace
}  // namespace tandem::contact
