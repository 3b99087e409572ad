// A hand that is moved by commands. It moves the pointer of the device "mouse", which the window's mouse moves in runs
// without commands.
#pragma once

#include <memory>
#include <optional>

#include "client/haptics/view.hpp"
#include "common/base/time.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

/// Moves the pointer of the device "mouse" along a straight line to a goal in the world. A spring pulls the device's
/// simulated hand (a mass with damping) to the pointer. The hand yields to forces, so forces are limited as for any
/// other hand.
///
/// Thread  main
class ScriptedHand {
 public:
  /// Speed in the device frame. Our choice: that of a careful user, an eighth of the speed that the device can follow.
  static constexpr double kSpeed_m_per_s = 0.1;
  static constexpr double kTurn_rad_per_s = 1;
  /// Largest distance between pointer and hand, as for the window's mouse. At this distance the spring exerts about the
  /// device's maximum force, so the pointer is not moved further.
  static constexpr double kMaxStretch_m = 0.05;
  static constexpr double kMaxTwist_rad = 0.6;
  /// The hand is at rest when it has been slower than these limits for kRestFor.
  static constexpr double kRestSpeed_m_per_s = 0.002;
  static constexpr double kRestTurn_rad_per_s = 0.02;
  static constexpr Duration kRestFor = std::chrono::milliseconds(300);

  /// In      pointer  pointer of the device; not null
  explicit ScriptedHand(std::shared_ptr<devices::Pointer> pointer);

  /// In      X_WH  goal of the handle in the world
  void move_to(const Pose& X_WH, LocalTime now);
  /// Presses or releases buttons of the handle.
  /// In      button  bits of Button
  void press(std::uint32_t button, bool is_down);
  /// Returns the target pose of the hand in the device frame, and its buttons.
  const devices::PointerTarget& target() const { return target_; }
  /// Moves the pointer as far as its speed limit permits in the time since the last call, and publishes it. After a
  /// change of the scene, ends the movement and releases the buttons instead.
  void follow(const View& view, LocalTime now);
  /// Returns true if the hand has come to rest since the last move_to(), either at the goal or at an obstacle.
  bool is_at_rest(LocalTime now) const;
  /// Returns whether the pointer has reached the goal and the hand is within kMaxStretch_m and kMaxTwist_rad of it.
  bool has_arrived() const { return has_arrived_; }

 private:
  void advance(const Pose& goal_DH, double dt_s);
  void stay_near(const Pose& X_DH);

  std::shared_ptr<devices::Pointer> pointer_;
  devices::PointerTarget target_;
  std::optional<Pose> goal_WH_;
  bool has_arrived_ = true;
  std::uint32_t scene_ = 0;  ///< generation number of the scene in the newest view
  LocalTime followed_{};
  LocalTime moved_{};  ///< last time at which the hand was not at rest, or of the last move_to()
};

/// Inverse of WorkspaceMapping::world_pose().
Pose device_pose(const WorkspaceMapping& workspace, const Pose& X_WH);

}  // namespace tandem::client
