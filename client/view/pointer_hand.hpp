// What mouse and keys do to the hand of the device "mouse": to the sides, up and down, away, and turning.
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
  /// The target may be so far from the hand, in the device's metres: what the arm's spring turns into about the device's
  /// largest force. Farther, and the way back would first be a dead way.
  static constexpr double kMaxStretch_m = 0.05;
  static constexpr double kMaxTwist_rad = 0.6;  ///< likewise, in rotation

  /// The target of now, for the device.
  const devices::PointerTarget& target() const { return target_; }
  void set_workspace(const WorkspaceMapping& workspace) { workspace_ = workspace; }
  Pose X_WH() const { return workspace_.world_pose(target_.X_DH); }

  /// To the sides and up and down, by shares of the window's height: as far as keeps the hand under the mouse. For who looks
  /// from far above, away and towards instead of up and down.
  void move(const Camera& camera, double right, double down);
  /// Likewise on the level: to the sides, away and towards; for who looks from far above, up and down.
  void move_level(const Camera& camera, double right, double down);
  /// About the picture's axes: `right` and `down` as the surface nearest to who looks would go, `roll` clockwise.
  void turn(const Camera& camera, double right_rad, double down_rad, double roll_rad);
  void press(std::uint32_t button, bool is_down);
  /// One key for both: lets go of what is held, else grabs what is within reach.
  void toggle_grab(bool is_holding, LocalTime now);
  /// Once a frame: a grab that found nothing within kGrabPatience is given up, so that the next one is one again.
  void follow_grab(bool is_holding, LocalTime now);
  /// The last grab found nothing, and not long ago.
  bool has_missed(LocalTime now) const { return missed_at_ && now - *missed_at_ < kMissShown; }
  /// Back to where the tool starts.
  void rest() { target_.X_DH = Pose{}; }
  /// Keeps the target near the hand, wherever that was held up.
  void stay_near(const Pose& X_DH);

 private:
  static constexpr Duration kGrabPatience = std::chrono::milliseconds(1500);  ///< longer than any round trip
  static constexpr Duration kMissShown = std::chrono::seconds(3);

  void move_along(const Camera& camera, double right, double down, const Vec3& axis_W);

  WorkspaceMapping workspace_;
  devices::PointerTarget target_;
  bool is_letting_go_ = false;  ///< the button goes up with the next frame
  LocalTime grabbed_at_{};
  std::optional<LocalTime> missed_at_;
};

}  // namespace tandem::client
