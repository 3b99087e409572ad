// Motion of the hand of the device "mouse" by mouse and keys: translation and rotation.
#pragma once

#include <optional>

#include "client/view/camera.hpp"
#include "common/base/time.hpp"
#include "common/base/workspace.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

/// Thread  the window's
class PointerHand {
 public:
  /// Maximum distance between target and hand, in device metres. At this distance the arm's spring applies about the
  /// device's maximum force. A larger distance would add a dead band on the way back.
  static constexpr double kMaxStretch_m = 0.05;
  static constexpr double kMaxTwist_rad = 0.6;  ///< maximum rotation, for the same reason

  /// Present target for the device.
  const devices::PointerTarget& target() const { return target_; }
  void set_workspace(const WorkspaceMapping& workspace) { workspace_ = workspace; }
  Pose X_WH() const { return workspace_.world_pose(target_.X_DH); }

  /// Moves the hand sideways and vertically by shares of the window's height, so that it stays under the mouse. With
  /// the camera high above the scene, away and towards replace up and down.
  void move(const Camera& camera, double right, double down);
  /// Moves the hand sideways and horizontally away or towards; with the camera high above the scene, up and down.
  void move_level(const Camera& camera, double right, double down);
  /// Turns about the picture's axes: the surface nearest to the camera moves by `right` and `down`; `roll` is
  /// clockwise.
  void turn(const Camera& camera, double right_rad, double down_rad, double roll_rad);
  void press(std::uint32_t button, bool is_down);
  /// Releases a held body, otherwise grabs one within reach; one key for both.
  void toggle_grab(bool is_holding, LocalTime now);
  /// Call once a frame: releases the button if a grab has found nothing within kGrabPatience, so that the next press
  /// grabs.
  void follow_grab(bool is_holding, LocalTime now);
  /// Returns whether the last grab found nothing, for kMissShown after it.
  bool has_missed(LocalTime now) const { return missed_at_ && now - *missed_at_ < kMissShown; }
  /// Moves the target back to the tool's start pose.
  void rest() { target_.X_DH = Pose{}; }
  /// Limits the distance between the target and the hand, which an obstacle may hold back.
  void stay_near(const Pose& X_DH);

 private:
  static constexpr Duration kGrabPatience = std::chrono::milliseconds(1500);  ///< longer than any round trip
  /// Minimum press of the button, long enough that one of its datagrams arrives.
  static constexpr Duration kPress = std::chrono::milliseconds(100);
  static constexpr Duration kMissShown = std::chrono::seconds(3);

  void move_along(const Camera& camera, double right, double down, const Vec3& axis_W);

  WorkspaceMapping workspace_;
  devices::PointerTarget target_;
  bool is_releasing_ = false;  ///< the button is released kPress after grabbed_at_
  LocalTime grabbed_at_{};
  std::optional<LocalTime> missed_at_;
};

}  // namespace tandem::client
