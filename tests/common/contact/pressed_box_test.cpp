// Presses a box on a floor, flat and tilted about an edge, and compares the forces with integrals over its surface.
// Wrong areas of points at edges would show here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "common/contact/contact_pair.hpp"
#include "common/contact/contact_reduction.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/common/contact/touch_rig.hpp"

namespace tandem::contact {
namespace {

constexpr double kStiffness = 5e9;
constexpr double kEdge_m = 0.02;
constexpr double kDegree = std::numbers::pi / 180;
// Additional tolerance [N] for a pressed wedge shorter than two spacings of points, because few points represent it.
constexpr double kFewPoints_n = 0.07;
// Mean error of sampled distances [m], which limits the accuracy of the force.
constexpr double kDistance_m = 3e-7;

/// Reference: force and torque, per metre along y, of an elastic foundation with the stiffness kStiffness on a tilted
/// box.
/// - The lowest edge of the box is at x = 0, `depth_m` below the floor.
/// - The bottom of the box rises along x by the angle `tilt`.
/// - The torque is about the line at x = 0 at the height of the floor.
struct Pressed {
  double f_x = 0, f_z = 0;
  double t_y = 0;

  void add(double x, double depth_m, double n_x, double n_z, double length_m) {
    const double f = kStiffness * depth_m * length_m;
    f_x += f * n_x;
    f_z += f * n_z;
    t_y -= f * n_z * x;
  }
  Pressed times(double a) const { return {a * f_x, a * f_z, a * t_y}; }
};

constexpr int kSlices = 200'000;

/// Returns the force on the points of the box that are below the floor.
Pressed of_box_points(double tilt, double depth_m) {
  Pressed sum;
  const double step = kEdge_m / kSlices;
  for (int i = 0; i < kSlices; ++i) {
    const double s = (i + 0.5) * step;
    const double below = depth_m - s * std::sin(tilt);
    if (below > 0) sum.add(s * std::cos(tilt), below, 0, 1, step);
    const double beside = depth_m - s * std::cos(tilt);
    if (beside > 0) sum.add(-s * std::sin(tilt), beside, 0, 1, step);
  }
  return sum;
}

void expect_pressed(const ContactShape& box, const ContactShape& floor, double floor_top_m, const std::string& what) {
  for (const double tilt_deg : {0.0, 0.1, 1.0, 10.0}) {
    for (const double depth_m : {2e-5, 5e-5, 1e-4, 2e-4}) {
      const double tilt = tilt_deg * kDegree;
      // The box is first tilted about y, so that its bottom rises along x from the lowest edge. Then it is rotated
      // about a vertical axis through a point on the floor.
      const Quat turn = quaternion_of({0, 0, 0.4}), lean = quaternion_of({0, -tilt, 0});
      const Vec3 edge_W(0.0013, -0.0021, floor_top_m - depth_m);
      const Pose X_WA{edge_W + turn * (lean * Vec3(kEdge_m / 2, 0, kEdge_m / 2)), turn * lean};
      ContactPair pair;
      pair.bind(&box, &floor);
      pair.find(X_WA, {}, 1e-4);
      const Vec3 at_W(edge_W.x(), edge_W.y(), floor_top_m);
      const Wrench W = contact_wrench(pair.contacts(), kStiffness, at_W).on_a_W;
      const Vec3 f = turn.conjugate() * W.f, t = turn.conjugate() * W.t;
      Pressed expected = of_box_points(tilt, depth_m);
      expected = expected.times(kEdge_m);
      const double reach_m = tilt > 0 ? std::min(kEdge_m, depth_m / std::sin(tilt)) : kEdge_m;
      const double slack_n = kFewPoints_n + kDistance_m * kStiffness * kEdge_m * reach_m;
      const std::string at = what + ", " + std::to_string(tilt_deg) + " deg, " + std::to_string(1e6 * depth_m) + " um";
      EXPECT_NEAR(f.z(), expected.f_z, 0.02 * expected.f_z + slack_n) << at;
      EXPECT_NEAR(f.x(), expected.f_x, 0.02 * expected.f_z + slack_n) << at;
      EXPECT_NEAR(t.y(), expected.t_y, 0.02 * std::abs(expected.t_y) + slack_n * reach_m) << at;
    }
  }
}

TEST(PressedBox, HasTheForceAndTorqueOfAFoundation) {
  const ShapePointer box = make_contact_box(Vec3::Constant(kEdge_m));
  const ShapePointer mesh_box = solid_of(box_mesh(Vec3::Constant(kEdge_m)));
  const ShapePointer large = make_contact_box({0.4, 0.4, 0.05});
  const ShapePointer mesh_floor = solid_of(box_mesh({0.05, 0.05, 0.01}));
  expect_pressed(*box, *large, 0.025, "box on a large floor");
  expect_pressed(*mesh_box, *large, 0.025, "mesh on a large floor");
  expect_pressed(*mesh_box, *mesh_floor, 0.005, "mesh on mesh");
}

}  // namespace
}  // namespace tandem::contact
