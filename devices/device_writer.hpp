// The last thing before a device: the clamp that nothing can get around.
#pragma once

#include "devices/device.hpp"

namespace tandem::devices {

/// Fails   std::invalid_argument when axes are missing or too many, when a limit of the spec is not finite, negative,
///         above its verified maximum, or above 2 N or 0.1 N·m while the maximum is unverified
void check_device_spec(const DeviceSpec& spec);

/// Clamps to the device's software limits with the direction kept, and writes. The limits are those of the spec at
/// construction: nothing that arrives later can widen them.
///
/// Thread  haptic
class DeviceWriter {
 public:
  /// Fails   as check_device_spec()
  explicit DeviceWriter(Device& device);
  /// Writes the clamped wrench (zero when not finite). Returns false when the device did not take it.
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept;
  /// True once zero has reached the device: over a device thread not before the second call.
  bool write_zero(LocalTime now) noexcept { return write(now, Wrench{}) && !device_.may_be_on(); }
  /// As Device::may_be_on().
  bool may_be_on() const noexcept { return device_.may_be_on(); }
  /// The last command that the device took, after the clamp: it acts until the next one is taken.
  const Wrench& written() const { return written_; }
  /// Whether the clamp changed the last command, taken or not.
  bool was_clamped() const { return was_clamped_; }

 private:
  Device& device_;
  double force_limit_n_ = 0;
  double torque_limit_n_m_ = 0;  ///< 0 for a device without torque
  Wrench written_;
  bool was_clamped_ = false;
};

}  // namespace tandem::devices
