// Last stage before a device. It clamps every command, and commands reach a device only through it.
#pragma once

#include "devices/device.hpp"

namespace tandem::devices {

/// Checks the numbers of axes and the limits in a spec.
/// Fails   std::invalid_argument: the number of axes is out of range, or a limit is wrong. A limit is wrong if it is
///         not finite, is negative or exceeds its verified maximum. If the maximum is unverified, a limit above 2 N or
///         0.1 N·m is wrong
void check_device_spec(const DeviceSpec& spec);

/// Writes wrenches to a device, clamped to the software limits of the device. Clamping keeps the direction. The limits
/// are copied from the spec at construction, so that they cannot be widened later.
///
/// Thread  haptic
class DeviceWriter {
 public:
  /// Fails   see check_device_spec()
  explicit DeviceWriter(Device& device);
  /// Writes the clamped wrench, or zero for a wrench that is not finite. Returns false if the device did not accept the
  /// command.
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept;
  /// Writes zero. Returns true once a zero has reached the device. For a device with its own thread, the first call
  /// always returns false, because the zero is still in transit.
  bool write_zero(LocalTime now) noexcept { return write(now, Wrench{}) && !device_.may_be_on(); }
  /// See Device::may_be_on().
  bool may_be_on() const noexcept { return device_.may_be_on(); }
  /// Returns the last command that the device accepted, after clamping. It acts on the hand until the next accepted
  /// command.
  const Wrench& written() const { return written_; }
  /// Returns whether the last command was clamped, even if the device did not accept it.
  bool was_clamped() const { return was_clamped_; }

 private:
  Device& device_;
  double force_limit_n_ = 0;
  double torque_limit_n_m_ = 0;  ///< torque limit; 0 for a device without torque
  Wrench written_;
  bool was_clamped_ = false;
};

}  // namespace tandem::devices
