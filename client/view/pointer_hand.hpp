// Translates and rotates the hand of the device "mouse" by mouse and keys.
#pragma once

#include <optional>

#include "client/view/camera.hpp"
#include "common/base/time.hpp"
#include "common/base/workspace.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

/// Converts motion of the mouse and pressed keys to a target pose for the simulated device "mouse".
///
/// Thread  the one that runs the window
class PointerHand {
 public:
  /// Largest distance between target and hand, in metres of the device. At this distance, the spring of the simulated
  /// arm exerts about the device's maximum force. With a larger distance the force would not increase, and the mouse
  /// would have to move back by the excess before the force decreases (dead zone).
  static constexpr double kMaxStretch_m = 0.05;
  static constexpr double kMaxTwist_rad = 0.6;  ///< largest rotation between target and hand, for the same reason

  /// Current target for the device.
  const devices::PointerTarget& target() const { return target_; }
  void set_workspace(const WorkspaceMapping& workspace) { workspace_ = workspace; }
  Pose X_WH() const { return workspace_.world_pose(target_.X_DH); }

  /// Moves the hand sideways and vertically, so that it follows the mouse. If the camera looks from above, the hand
  /// moves horizontally away from or towards the camera instead of vertically.
  /// In      right, down  motion of the mouse, in fractions of the window's height
  void move(const Camera& camera, double right, double down);
  /// Moves the hand sideways, and horizontally away from or towards the camera. If the camera looks from above, the
  /// hand moves up and down instead of away and towards.
  void move_level(const Camera& camera, double right, double down);
  /// Rotates the hand about the axes of the picture. For positive angles, the side of the hand that faces the camera
  /// moves to the right and down, and the roll is clockwise.
  void turn(const Camera& camera, double right_rad, double down_rad, double roll_rad);
  void press(std::uint32_t button, bool is_down);
  /// Function of the key that both grabs and releases: releases the held body; if there is none, grabs a body within
  /// reach.
  void toggle_grab(bool is_holding, LocalTime now);
  /// Releases the button if a grab has not succeeded within kGrabPatience, so that the next press grabs again. Call
  /// once a frame.
  void follow_grab(bool is_holding, LocalTime now);
  /// Returns true for the duration kMissShown after a grab that found no body.
  bool has_missed(LocalTime now) const { return missed_at_ && now - *missed_at_ < kMissShown; }
  /// Moves the target back to the start pose of the tool.
  void rest() { target_.X_DH = Pose{}; }
  /// Limits the distance between the target and the hand, because an obstacle may prevent the hand from following.
  void stay_near(const Pose& X_DH);

 private:
  /// Time-out of a grab. It is longer than round trips in practice.
  static constexpr Duration kGrabPatience = std::chrono::milliseconds(1500);
  /// Shortest time for which the button is pressed, so that at least one datagram with the pressed button arrives.
  static constexpr Duration kPress = std::chrono::milliseconds(100);
  static constexpr Duration kMissShown = std::chrono::seconds(3);

  void move_along(const Camera& camera, double right, double down, const Vec3& axis_W);

  WorkspaceMapping workspace_;
  devices::PointerTarget target_;
  bool is_releasing_ = false;  ///< true: the button must be released at grabbed_at_ + kPress
  LocalTime grabbed_at_{};
  std::optional<LocalTime> missed_at_;
};

}  // namespace tandem::client
