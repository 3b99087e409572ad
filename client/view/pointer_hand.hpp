// Motion of the hand of the device "mouse", by mouse and keys: translation and rotation.
#pragma once

#include <optional>

#include "client/view/camera.hpp"
#include "common/base/time.hpp"
#include "common/base/workspace.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

/// Converts motion of mouse and keys to a target pose for the device "mouse".
///
/// Thread  the window's
class PointerHand {
 public:
  /// Largest distance between target and hand, in device metres. At this distance the spring of the simulated arm
  /// exerts about the device's maximum force. A larger distance would only add a dead zone when the mouse moves back.
  static constexpr double kMaxStretch_m = 0.05;
  static constexpr double kMaxTwist_rad = 0.6;  ///< largest rotation between target and hand, for the same reason

  /// Current target for the device.
  const devices::PointerTarget& target() const { return target_; }
  void set_workspace(const WorkspaceMapping& workspace) { workspace_ = workspace; }
  Pose X_WH() const { return workspace_.world_pose(target_.X_DH); }

  /// Moves the hand sideways and vertically by fractions of the window's height, so that it stays under the mouse. If
  /// the camera looks from above, the hand moves away and towards the camera instead of up and down.
  void move(const Camera& camera, double right, double down);
  /// Moves the hand sideways and horizontally, away from or towards the camera. If the camera looks from above, it
  /// moves up and down instead.
  void move_level(const Camera& camera, double right, double down);
  /// Rotates the hand about the picture's axes. The surface nearest to the camera moves by `right` and `down`; `roll`
  /// is clockwise.
  void turn(const Camera& camera, double right_rad, double down_rad, double roll_rad);
  void press(std::uint32_t button, bool is_down);
  /// Releases the held body if there is one; otherwise grabs one within reach. One key is used for both.
  void toggle_grab(bool is_holding, LocalTime now);
  /// Releases the button if a grab has found no body within kGrabPatience, so that the next press grabs again. Call
  /// once a frame.
  void follow_grab(bool is_holding, LocalTime now);
  /// Returns true for kMissShown after a grab that found no body.
  bool has_missed(LocalTime now) const { return missed_at_ && now - *missed_at_ < kMissShown; }
  /// Moves the target back to the start pose of the tool.
  void rest() { target_.X_DH = Pose{}; }
  /// Limits the distance between the target and the hand, because an obstacle may prevent the hand from following.
  void stay_near(const Pose& X_DH);

 private:
  /// time to wait for a grab, longer than any round trip
  static constexpr Duration kGrabPatience = std::chrono::milliseconds(1500);
  /// Shortest time for which the button is pressed, long enough that at least one of its datagrams arrives.
  static constexpr Duration kPress = std::chrono::milliseconds(100);
  static constexpr Duration kMissShown = std::chrono::seconds(3);

  void move_along(const Camera& camera, double right, double down, const Vec3& axis_W);

  WorkspaceMapping workspace_;
  devices::PointerTarget target_;
  bool is_releasing_ = false;  ///< the button is to be released kPress after grabbed_at_
  LocalTime grabbed_at_{};
  std::optional<LocalTime> missed_at_;
};

}  // namespace tandem::client
