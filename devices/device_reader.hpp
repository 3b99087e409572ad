// First stage after a device: rejects samples that no hand could have produced.
#pragma once

#include "devices/device.hpp"

namespace tandem::devices {

/// Reads a device and marks each implausible sample invalid, with a readable `reason`.
///
/// Model   a sample is plausible if the device is ready and marks it valid, and
///         finite   pose and twist are finite
///         age      |now − taken| ≤ 20 ms: a constant time stamp means that the device hangs
///         rotation ||q| − 1| ≤ 10⁻³
///         place    |p| ≤ DeviceSpec::reach_m
///         speed    |v|, and the displacement since the previous sample over time, ≤ 3 ·
///                  DeviceSpec::speed_limit_m_per_s; rotation likewise, with 300 rad/s. Between one and three times
///                  the limit the hand is too fast, and the safety chain drops the force (common/haptics/safety.hpp).
///                  Above, the sample is wrong
///         The previous sample is the last finite one, plausible or not, so that a single jump costs two samples.
/// Thread  haptic: no allocation, no throw
class DeviceReader {
 public:
  explicit DeviceReader(Device& device) : device_(device) {}
  /// Reads a sample; clears the bits of buttons that the device does not have.
  DeviceSample read(LocalTime now) noexcept;

 private:
  std::string_view find_fault(LocalTime now, const DeviceSample& sample) const noexcept;
  bool has_jumped(const DeviceSample& sample) const noexcept;

  Device& device_;
  DeviceSample before_;
  bool has_before_ = false;
};

}  // namespace tandem::devices
