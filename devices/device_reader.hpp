// The first thing behind a device: what it says of the hand is believed only as far as a hand could do it.
#pragma once

#include "devices/device.hpp"

namespace tandem::devices {

/// Reads a device and marks every sample invalid that no hand on this device can have given, with a `reason` in words.
///
/// Model   a sample is plausible when the device is ready and calls it valid, and
///         finite   all of pose and twist is
///         age      |now − taken| ≤ 20 ms: a time stamp that stands still is a device that hangs
///         rotation ||q| − 1| ≤ 10⁻³
///         place    |p| ≤ DeviceSpec::reach_m
///         speed    |v| and the way since the sample before ≤ 3 · DeviceSpec::speed_limit_m_per_s, likewise the turn
///                  with 300 rad/s. Between once and three times the limit it is a hand that is too fast, which the
///                  safety chain lets go (common/haptics/safety.hpp); beyond, no place at all
///         The sample before is the last finite one, plausible or not, so that a single jump costs two samples.
/// Thread  haptic: no allocation, no throw
class DeviceReader {
 public:
  explicit DeviceReader(Device& device) : device_(device) {}
  /// Buttons that the device does not have are left out.
  DeviceSample read(LocalTime now) noexcept;

 private:
  std::string_view find_fault(LocalTime now, const DeviceSample& sample) const noexcept;
  bool has_jumped(const DeviceSample& sample) const noexcept;

  Device& device_;
  DeviceSample before_;
  bool has_before_ = false;
};

}  // namespace tandem::devices
