#include "client/view/camera.hpp"

#include <gtest/gtest.h>

namespace tandem::client {
namespace {

/// Returns the position of a point in the window (x, y) and its distance from the camera (z). The position is relative
/// to the centre of the window, with x to the right and y up, each −1 to 1 at the edges.
Vec3 seen(const Camera& camera, const Vec3& point_W) {
  const Eigen::Vector4f at = camera.projection_of_world(1) * point_W.cast<float>().homogeneous();
  return {at.x() / at.w(), at.y() / at.w(), at.w()};
}

/// Returns a camera that was moved by deflecting the cap of a 3D mouse for half a second.
Camera steered(const Vec3& deflection, const Vec3& turn) {
  Camera camera;
  camera.fit({0.1, 0.2, 0.3}, 0.2);
  for (int i = 0; i < 30; ++i) camera.steer(deflection, turn, 1 / 60.0);
  return camera;
}

TEST(Camera, PushingTheCapMovesTheScene) {
  const Vec3 point_W(0.1, 0.2, 0.3), none = Vec3::Zero();
  const Vec3 before = seen(steered(none, none), point_W);
  EXPECT_GT((seen(steered({1, 0, 0}, none), point_W) - before).x(), 0.3);
  EXPECT_GT((seen(steered({0, 0, 1}, none), point_W) - before).y(), 0.3);
  EXPECT_GT((seen(steered({0, 1, 0}, none), point_W) - before).z(), 0.1);
  EXPECT_LT((seen(steered({0, -1, 0}, none), point_W) - before).z(), -0.1);
}

TEST(Camera, TurningTheCapTurnsTheScene) {
  const Camera at_rest = steered({0, 0, 0}, {0, 0, 0});
  const Vec3 near_W = Vec3(0.1, 0.2, 0.3) - 0.1 * at_rest.forward_W();
  const Vec3 before = seen(at_rest, near_W);
  EXPECT_GT((seen(steered({0, 0, 0}, {0, 0, 1}), near_W) - before).x(), 0.1) << "counter-clockwise from above";
  EXPECT_LT((seen(steered({0, 0, 0}, {1, 0, 0}), near_W) - before).y(), -0.1)
      << "the top of the scene must move towards the camera";
}

TEST(Camera, ALongPauseIsNoLeap) {
  Camera camera;
  camera.fit({0, 0, 0}, 0.2);
  const Vec3 before = camera.eye_W();
  camera.steer({1, 1, 1}, {1, 1, 1}, 1e6);
  EXPECT_LT((camera.eye_W() - before).norm(), 0.2);
}

TEST(Camera, ARayPassesThroughThePointThatIsDrawnThere) {
  Camera camera = steered({0.3, 0, 0.2}, {0.2, 0, 0.5});
  camera.leave_free(0.25);
  const double aspect = 1.6;
  const Vec3 point_W(0.13, 0.18, 0.33);
  const Eigen::Vector4f at = camera.projection_of_world(aspect) * point_W.cast<float>().homogeneous();
  const auto [from_W, along_W] = camera.ray_at(0.5 + 0.5 * at.x() / at.w(), 0.5 - 0.5 * at.y() / at.w(), aspect);
  EXPECT_LT((point_W - from_W).cross(along_W).norm(), 1e-5);
  EXPECT_GT((point_W - from_W).dot(along_W), 0);
}

}  // namespace
}  // namespace tandem::client
