// A mouse as a device of six directions: a window says where the hand should be, a simulated hand goes there and feels.
#pragma once

#include <memory>

#include "devices/device.hpp"
#include "devices/hand_dynamics.hpp"
#include "devices/mouse/rumble.hpp"
#include "devices/pointer.hpp"

namespace tandem::devices {

/// A hand that follows a pointer. Pointers jump, 60 times a second; so what the hand intends is smoothed, and the force
/// acts on a hand with mass, damping and a spring, as of a person.
///
/// Model   ẍ = ω² (target − x) − 2 ω ẋ, speed at most kMaxSpeed_m_per_s, likewise in rotation; the hand of HandDynamics
///         intends to be at x. ω and the bounds are ours: an answer within 0.1 s, and below what a device allows
/// Thread  haptic
class MouseDevice final : public Device {
 public:
  static constexpr double kSmoothing_rad_per_s = 45;
  static constexpr double kMaxSpeed_m_per_s = 0.8;
  static constexpr double kMaxTurn_rad_per_s = 6;
  static constexpr double kReach_m = kPointerReach_m;

  /// In      pointer  not null; rumble  null: none, else shows the force as a share of the device's limit
  MouseDevice(DeviceSpec spec, const HandParameters& hand, std::shared_ptr<Pointer> pointer,
              std::unique_ptr<Rumble> rumble = nullptr);
  /// A hand on a mouse: damped more than one in the air (ratio 0.8), so that what is displayed does not swing.
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
