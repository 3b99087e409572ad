// What mouse and keys do to the hand of the device "mouse": in the plane of the picture, in depth, and turning.
#pragma once

#include "client/view/camera.hpp"
#include "common/base/workspace.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

/// Thread  the window's
class PointerHand {
 public:
  /// The target may be so far from the hand, in the device's metres: what the arm's spring turns into about the device's
  /// largest force. Farther, and the way back would first be a dead way.
  static constexpr double kMaxStretch_m = 0.05;
  static constexpr double kMaxTwist_rad = 0.6;  ///< likewise, in rotation

  /// The target of now, for the device.
  const devices::PointerTarget& target() const { return target_; }
  void set_workspace(const WorkspaceMapping& workspace) { workspace_ = workspace; }
  Pose X_WH() const { return workspace_.world_pose(target_.X_DH); }

  /// By shares of the window's height, at the depth where the hand is, so that it stays under the mouse.
  void move(const Camera& camera, double right, double down);
  /// Away from who looks, as far as so much of the window's height is.
  void move_away(const Camera& camera, double share);
  /// About the picture's axes: `right` and `down` as the surface nearest to who looks would go, `roll` clockwise.
  void turn(const Camera& camera, double right_rad, double down_rad, double roll_rad);
  void press(std::uint32_t button, bool is_down);
  /// Back to where the tool starts.
  void rest() { target_.X_DH = Pose{}; }
  /// Keeps the target near the hand, wherever that was held up.
  void stay_near(const Pose& X_DH);

 private:
  void shift(const Vec3& by_W);

  WorkspaceMapping workspace_;
  devices::PointerTarget target_;
};

}  // namespace tandem::client
