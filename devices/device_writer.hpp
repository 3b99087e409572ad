// Last stage before a device: the clamp that no command can bypass.
#pragma once

#include "devices/device.hpp"

namespace tandem::devices {

/// Checks the axes and limits of a spec.
/// Fails   std::invalid_argument: axes are missing or too many; or a limit of the spec is not finite, negative, above
///         its verified maximum, or above 2 N or 0.1 N·m while the maximum is unverified
void check_device_spec(const DeviceSpec& spec);

/// Clamps to the device's software limits, keeping the direction, and writes. The limits are copied from the spec at
/// construction: no later input can widen them.
///
/// Thread  haptic
class DeviceWriter {
 public:
  /// Fails   see check_device_spec()
  explicit DeviceWriter(Device& device);
  /// Writes the clamped wrench (zero when not finite). Returns false if the device did not accept it.
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept;
  /// Returns true once zero has reached the device; with a device thread not before the second call.
  bool write_zero(LocalTime now) noexcept { return write(now, Wrench{}) && !device_.may_be_on(); }
  /// See Device::may_be_on().
  bool may_be_on() const noexcept { return device_.may_be_on(); }
  /// Last command that the device accepted, after the clamp: it acts until the next accepted one.
  const Wrench& written() const { return written_; }
  /// Whether the clamp changed the last command, accepted or not.
  bool was_clamped() const { return was_clamped_; }

 private:
  Device& device_;
  double force_limit_n_ = 0;
  double torque_limit_n_m_ = 0;  ///< 0 for a device without torque
  Wrench written_;
  bool was_clamped_ = false;
};

}  // namespace tandem::devices
