// Search and solver on shapes whose contact has a formula.
#include <gtest/gtest.h>

#include "common/contact/contact_reduction.hpp"
#include "common/contact/tessellation.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/common/contact/touch_rig.hpp"

namespace tandem {
namespace {

constexpr double kStiffness = 5e9;
constexpr double kBand_m = 2e-4;
const double kOneDegree = std::numbers::pi / 180;

struct Touch {
  ShapePointer a, b;
  Pose X_WA;
  Vec3 direction_W = Vec3::UnitZ();  ///< in which A is pushed
  double depth_m = 0;
  double spacing_m = 4.5e-4;  ///< of the points that stand for the surfaces
  double field_error_m = 0;   ///< of a mesh's distance, and of the mesh against the shape it stands for
};

std::vector<ContactPoint> contacts_of(const ContactShape& a, const ContactShape& b, const Pose& X_WA) {
  ContactPair pair({});
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
  EXPECT_NEAR(deepest_m, touch.depth_m, 0.02 * touch.spacing_m + touch.field_error_m) << what;
  const Vec3 force = contact_wrench(contacts, kStiffness, touch.X_WA.p).on_a_W.f;
  EXPECT_LT(angle_between(force, touch.direction_W), kOneDegree) << what;
}

/// Where a lattice of samples may lie on the curved surface.
const std::vector<Vec3>& turns() {
  static const std::vector<Vec3> all = {{0, 0, 0}, {0.3, 0, 0}, {0, 1.1, 0.4}, {1, 2, 3}, {-0.7, 0.9, 0.2}};
  return all;
}

/// Of a ball's cap under a plane: ∫ k (d − r²/2R) 2πr dr.
double cap_force_n(double radius_m, double depth_m) {
  return kStiffness * std::numbers::pi * radius_m * depth_m * depth_m;
}

void expect_ball_on_floor(const ShapePointer& ball, const ShapePointer& floor, double radius_m, double ball_error_m,
                          double force_share) {
  for (const double depth_m : {1e-4, 2e-4, 4e-4}) {
    for (const Vec3& turn : turns()) {
      Touch touch{ball, floor, {{0.0011, -0.0007, radius_m - depth_m}, quaternion_of(turn)}};
      touch.depth_m = depth_m;
      touch.spacing_m = std::max(ball->shells.surface.spacing_m, 4.5e-4);
      // Between the lowest sample and the lowest point of the ball.
      touch.field_error_m = ball_error_m;
      const std::string what = "depth " + std::to_string(depth_m);
      expect_depth_and_direction(touch, what);
      const auto contacts = contacts_of(*ball, *floor, touch.X_WA);
      for (const ContactPoint& c : contacts) {
        if (c.depth_m > 0) EXPECT_LT(angle_between(c.normal_W, Vec3::UnitZ()), 0.1) << what;
      }
      const double force_n = contact_wrench(contacts, kStiffness, Vec3::Zero()).on_a_W.f.norm();
      EXPECT_NEAR(force_n, cap_force_n(radius_m, depth_m), force_share * cap_force_n(radius_m, depth_m)) << what;
    }
  }
}


}  // namespace
}  // namespace tandem
