// What is dragged stays under the mouse, from wherever the scene is looked at.
#include "client/view/pointer_hand.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/buttons.hpp"

namespace tandem::client {
namespace {

/// Of the window, from its middle: x to the right, y up, each −1 to 1.
Eigen::Vector2d seen(const Camera& camera, double aspect, const Vec3& point_W) {
  const Eigen::Vector4f at = camera.projection_of_world(aspect) * point_W.cast<float>().homogeneous();
  return {at.x() / at.w(), at.y() / at.w()};
}

WorkspaceMapping turned_workspace() {
  WorkspaceMapping workspace;
  workspace.X_WD = {Vec3(0.1, 0.2, 0.3), quaternion_of({0.3, -0.2, 1.1})};
  workspace.position_scale = 2;
  return workspace;
}

Camera camera_on(const Vec3& point) {
  Camera camera;
  camera.fit(point, 0.2);
  camera.orbit(0.3, 0.1);
  return camera;
}

TEST(Camera, ShowsWhatItFitsWhole) {
  for (const double free : {0.0, 0.25}) {
    Camera camera = camera_on({1, 2, 3});
    camera.leave_free(free);
    const double aspect = 1.6;
    EXPECT_LT((seen(camera, aspect, {1, 2, 3}) - Eigen::Vector2d(-free, 0)).norm(), 1e-4);
    for (int i = 0; i < 50; ++i) {
      const Vec3 rim = 0.2 * Vec3(std::cos(i), std::sin(i) * std::cos(3 * i), std::sin(i) * std::sin(3 * i));
      EXPECT_LE(std::abs(seen(camera, aspect, Vec3(1, 2, 3) + rim).y()), 1.001) << i;
    }
  }
}

TEST(Camera, SeesWhatIsHigherHigherAndWhatIsNearerLarger) {
  const Camera camera = camera_on(Vec3::Zero());
  EXPECT_GT(seen(camera, 1, {0, 0, 0.1}).y(), 0);
  EXPECT_GT(camera.height_at_m(camera.eye_W() + 2 * camera.forward_W()),
            1.9 * camera.height_at_m(camera.eye_W() + camera.forward_W()));
}

TEST(PointerHand, StaysUnderTheMouse) {
  PointerHand hand;
  hand.set_workspace(turned_workspace());
  const Camera camera = camera_on(hand.X_WH().p);
  const double aspect = 1.5;
  const Eigen::Vector2d before = seen(camera, aspect, hand.X_WH().p);
  hand.move(camera, 0.2, 0.1);
  const Eigen::Vector2d moved = seen(camera, aspect, hand.X_WH().p) - before;
  // Shares of the window's height; clip coordinates go over two of them.
  EXPECT_NEAR(moved.x(), 2 * 0.2 / aspect, 1e-4);
  EXPECT_NEAR(moved.y(), -2 * 0.1, 1e-4);
}

TEST(PointerHand, GoesAwayAlongTheLookOfThePicture) {
  PointerHand hand;
  hand.set_workspace(turned_workspace());
  const Camera camera = camera_on(hand.X_WH().p);
  const Vec3 before = hand.X_WH().p;
  hand.move_away(camera, 0.1);
  EXPECT_GT((hand.X_WH().p - before).normalized().dot(camera.forward_W()), 0.9999);
}

TEST(PointerHand, TurnsAboutTheAxesOfThePicture) {
  PointerHand hand;
  hand.set_workspace(turned_workspace());
  const Camera camera = camera_on(hand.X_WH().p);
  const Quat before = hand.X_WH().q;
  hand.turn(camera, 0.2, 0, 0);
  EXPECT_LT((rotation_vector(hand.X_WH().q * before.conjugate()) - 0.2 * camera.up_W()).norm(), 1e-9);
}

TEST(PointerHand, WaitsForAHandThatIsHeldUp) {
  PointerHand hand;
  const Camera camera = camera_on(Vec3::Zero());
  for (int i = 0; i < 100; ++i) {
    hand.move(camera, 0.05, 0);
    hand.turn(camera, 0.1, 0, 0);
    hand.stay_near(Pose{});
  }
  EXPECT_NEAR(hand.target().X_DH.p.norm(), PointerHand::kMaxStretch_m, 1e-9);
  EXPECT_LE(rotation_vector(hand.target().X_DH.q).norm(), PointerHand::kMaxTwist_rad + 1e-9);
}

TEST(PointerHand, PressesAndLetsGoOfOneButtonApart) {
  PointerHand hand;
  hand.press(kButtonGrab, true);
  hand.press(kButtonClutch, true);
  hand.press(kButtonGrab, false);
  EXPECT_EQ(hand.target().buttons, kButtonClutch);
}

}  // namespace
}  // namespace tandem::client
