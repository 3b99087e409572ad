// First stage after a device: rejects samples that a hand cannot have produced.
#pragma once

#include "devices/device.hpp"

namespace tandem::devices {

/// Reads samples from a device. An implausible sample is marked invalid and gets a readable `reason`.
///
/// Model   A sample is plausible if the device is ready, marks it valid, and all of the following holds:
///         finite   pose and twist are finite
///         age      |now − taken| ≤ 20 ms; an older sample means that the device no longer responds
///         rotation ||q| − 1| ≤ 10⁻³
///         position |p| ≤ DeviceSpec::reach_m
///         speed    |v| ≤ 3 · DeviceSpec::speed_limit_m_per_s, and the same limit for the displacement since the
///                  previous sample divided by the time; for rotations the limit is 300 rad/s
///         Two limits of speed: above the speed limit itself, the hand is too fast, and the safety chain removes the
///         force (common/haptics/safety.hpp). Above three times this limit, the sample counts as wrong.
///         The previous sample is the last finite one, plausible or not. A single wrong sample therefore invalidates
///         two samples: itself and the one after it, which differs from it by a jump.
/// Thread  haptic: no allocation, no throw
class DeviceReader {
 public:
  explicit DeviceReader(Device& device) : device_(device) {}
  /// Reads a sample, and clears the bits of buttons that the device lacks.
  DeviceSample read(LocalTime now) noexcept;

 private:
  std::string_view find_fault(LocalTime now, const DeviceSample& sample) const noexcept;
  bool has_jumped(const DeviceSample& sample) const noexcept;

  Device& device_;
  DeviceSample before_;
  bool has_before_ = false;
};

}  // namespace tandem::devices
