// Tests PointerHand. In particular, a dragged hand must stay under the mouse pointer for every direction of view.
#include "client/view/pointer_hand.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/buttons.hpp"

namespace tandem::client {
namespace {

/// Returns the position of a point in the window, relative to its centre: x to the right and y up, each −1 to 1 at the
/// edges.
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

TEST(Camera, ShowsTheWholeBallThatItFits) {
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

TEST(Camera, ShowsHigherPointsHigherAndNearerObjectsLarger) {
  const Camera camera = camera_on(Vec3::Zero());
  EXPECT_GT(seen(camera, 1, {0, 0, 0.1}).y(), 0);
  EXPECT_GT(camera.height_at_m(camera.eye_W() + 2 * camera.forward_W()),
            1.9 * camera.height_at_m(camera.eye_W() + camera.forward_W()));
}

TEST(PointerHand, StaysUnderTheMouseForAnyDirectionOfView) {
  for (const double above : {-0.15, 0.0, 0.05, 0.2}) {
    for (const bool is_level : {false, true}) {
      PointerHand hand;
      hand.set_workspace(turned_workspace());
      Camera camera = camera_on(hand.X_WH().p);
      camera.orbit(0, above);
      const double aspect = 1.5;
      const Eigen::Vector2d before = seen(camera, aspect, hand.X_WH().p);
      is_level ? hand.move_level(camera, 0.01, 0.01) : hand.move(camera, 0.01, 0.01);
      const Eigen::Vector2d moved = seen(camera, aspect, hand.X_WH().p) - before;
      // The motion is 0.01 of the window's height, and the height is 2 in the units of seen().
      EXPECT_NEAR(moved.x(), 2 * 0.01 / aspect, 0.001) << above;
      if (above > -0.1 && above < 0.1) {
        EXPECT_NEAR(moved.y(), -2 * 0.01, 0.002) << above << is_level;
      }
      EXPECT_LE(std::abs(moved.y()), 0.022) << "and never runs ahead of it";
    }
  }
}

TEST(PointerHand, MovesVerticallyOrHorizontallyBySeparateFunctions) {
  PointerHand hand;
  hand.set_workspace(turned_workspace());
  const Camera camera = camera_on(hand.X_WH().p);
  const Vec3 before = hand.X_WH().p;
  hand.move(camera, 0, -0.1);
  EXPECT_GT((hand.X_WH().p - before).normalized().z(), 0.9999);
  const Vec3 lifted = hand.X_WH().p;
  hand.move_level(camera, 0, -0.1);
  EXPECT_NEAR(hand.X_WH().p.z(), lifted.z(), 1e-9);
  EXPECT_GT((hand.X_WH().p - lifted).dot(camera.forward_W()), 0.01);
}

TEST(PointerHand, TurnsAboutTheAxesOfThePicture) {
  PointerHand hand;
  hand.set_workspace(turned_workspace());
  const Camera camera = camera_on(hand.X_WH().p);
  const Quat before = hand.X_WH().q;
  hand.turn(camera, 0.2, 0, 0);
  EXPECT_LT((rotation_vector(hand.X_WH().q * before.conjugate()) - 0.2 * camera.up_W()).norm(), 1e-9);
}

TEST(PointerHand, StaysNearAnObstructedHand) {
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

TEST(PointerHand, PressesAndReleasesButtonsSeparately) {
  PointerHand hand;
  hand.press(kButtonGrab, true);
  hand.press(kButtonClutch, true);
  hand.press(kButtonGrab, false);
  EXPECT_EQ(hand.target().buttons, kButtonClutch);
}

TEST(PointerHand, OneKeyGrabsAndReleasesEvenBodiesAttachedByTheScene) {
  PointerHand hand;
  LocalTime now{std::chrono::seconds(1)};
  const auto is_down = [&hand] { return (hand.target().buttons & kButtonGrab) != 0; };
  hand.toggle_grab(false, now);
  hand.follow_grab(false, now);
  EXPECT_TRUE(is_down());
  now += std::chrono::seconds(5);
  hand.follow_grab(true, now);
  EXPECT_TRUE(is_down()) << "as long as it holds something";
  hand.toggle_grab(true, now);
  EXPECT_FALSE(is_down());

  hand.toggle_grab(true, now);
  EXPECT_TRUE(is_down()) << "held without the button: down …";
  now += std::chrono::milliseconds(50);
  hand.follow_grab(true, now);
  EXPECT_TRUE(is_down()) << "… for long enough that a lost datagram does not matter …";
  now += std::chrono::milliseconds(50);
  hand.follow_grab(true, now);
  EXPECT_FALSE(is_down()) << "… and up";
}

TEST(PointerHand, AGrabWithoutABodyTimesOutAndIsReported) {
  PointerHand hand;
  LocalTime now{std::chrono::seconds(1)};
  hand.toggle_grab(false, now);
  hand.follow_grab(false, now + std::chrono::seconds(1));
  EXPECT_FALSE(hand.has_missed(now + std::chrono::seconds(1))) << "the server is far away";
  hand.follow_grab(false, now + std::chrono::seconds(2));
  EXPECT_EQ(hand.target().buttons, 0U);
  EXPECT_TRUE(hand.has_missed(now + std::chrono::seconds(2)));
  EXPECT_FALSE(hand.has_missed(now + std::chrono::seconds(6)));
}

}  // namespace
}  // namespace tandem::client
