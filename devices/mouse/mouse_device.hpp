// A mouse as a device with six axes. A window sets a target pose, and a simulated hand follows it while the force acts.
#pragma once

#include <memory>

#include "devices/device.hpp"
#include "devices/hand_dynamics.hpp"
#include "devices/mouse/rumble.hpp"
#include "devices/pointer.hpp"

namespace tandem::devices {

/// A simulated hand that follows a pointer. The pointer sets a target about 60 times a second. Because the target moves
/// in jumps, a filter smooths it to the intended pose of the hand. The hand has mass and damping, and a spring pulls it
/// to the intended pose while the force acts on it.
///
/// Model   ẍ = ω² (target − x) − 2 ω ẋ, and the corresponding equation for rotation
///         x  intended pose of HandDynamics; its speed is at most kMaxSpeed_m_per_s
///         ω  kSmoothing_rad_per_s
///         ω and the limits are our choice: the response takes less than 0.1 s and stays below the limits of a device.
/// Thread  haptic
class MouseDevice final : public Device {
 public:
  static constexpr double kSmoothing_rad_per_s = 45;
  static constexpr double kMaxSpeed_m_per_s = 0.8;
  static constexpr double kMaxTurn_rad_per_s = 6;
  static constexpr double kReach_m = kPointerReach_m;

  /// In      pointer  target set by a window; must not be null
  ///         rumble   game pad that displays the force, as a fraction of the device's force limit; may be null
  MouseDevice(DeviceSpec spec, const HandParameters& hand, std::shared_ptr<Pointer> pointer,
              std::unique_ptr<Rumble> rumble = nullptr);
  /// Returns the parameters of a hand on a mouse. The damping ratio is 0.8, higher than that of a hand in the air, so
  /// that the displayed hand does not oscillate.
  static HandParameters default_hand();

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample read(LocalTime now) noexcept override;
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;

 private:
  void advance(double dt_s) noexcept;

  DeviceSpec spec_;
  std::shared_ptr<Pointer> pointer_;
  std::unique_ptr<Rumble> rumble_;
  HandDynamics hand_;
  PointerTarget target_;
  Pose intended_;
  Twist intended_rate_;
  Wrench on_hand_D_;
  LocalTime last_read_{};
  bool has_started_ = false;
};

}  // namespace tandem::devices
