// A hand that commands move: the device "mouse" follows a pointer, and here a script has it instead of a window.
#pragma once

#include <memory>
#include <optional>

#include "client/haptics/view.hpp"
#include "common/base/time.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

/// Moves the pointer of the device "mouse" along a straight line to a goal in the world. The device's own hand, with mass,
/// damping and spring, follows it and yields to forces; so forces are limited as for any other hand.
///
/// Thread  main
class ScriptedHand {
 public:
  /// At the device. As fast as a person who is careful, an eighth of what the device follows.
  static constexpr double kSpeed_m_per_s = 0.1;
  static constexpr double kTurn_rad_per_s = 1;
  /// Farthest that the pointer is from the hand, as of a mouse in the window: there the hand's spring presses with about
  /// the device's largest force, and the pointer waits.
  static constexpr double kMaxStretch_m = 0.05;
  static constexpr double kMaxTwist_rad = 0.6;
  /// The hand rests when it has been slower than this for so long.
  static constexpr double kRestSpeed_m_per_s = 0.002;
  static constexpr double kRestTurn_rad_per_s = 0.02;
  static constexpr Duration kRestFor = std::chrono::milliseconds(300);

  /// In      pointer  of the device; not null
  explicit ScriptedHand(std::shared_ptr<devices::Pointer> pointer);

  /// In      X_WH  for the handle, in the world
  void go_to(const Pose& X_WH, LocalTime now);
  /// Presses or releases buttons of the handle.
  /// In      button  bits of Button
  void press(std::uint32_t button, bool is_down);
  /// Where the hand intends to be, at the device.
  const devices::PointerTarget& target() const { return target_; }
  /// Moves the pointer by what its speed allows since the last call, and publishes it. Another scene ends the movement and
  /// releases the buttons.
  void follow(const View& view, LocalTime now);
  /// Since the last go_to() the hand has come to rest: at the goal, or where something holds it up.
  bool is_at_rest(LocalTime now) const;
  /// The pointer is at the goal: nothing holds the hand up by more than kMaxStretch_m.
  bool has_arrived() const { return has_arrived_; }

 private:
  void advance(const Pose& goal_DH, double dt_s);
  void stay_near(const Pose& X_DH);

  std::shared_ptr<devices::Pointer> pointer_;
  devices::PointerTarget target_;
  std::optional<Pose> goal_WH_;
  bool has_arrived_ = true;
  std::uint32_t scene_ = 0;  ///< generation
  LocalTime followed_{};
  LocalTime moved_{};  ///< when the hand was last faster than at rest, or sent off
};

/// The inverse of WorkspaceMapping::world_pose().
Pose device_pose(const WorkspaceMapping& workspace, const Pose& X_WH);

}  // namespace tandem::client
