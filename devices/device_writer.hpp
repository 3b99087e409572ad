// The last thing before a device: the clamp that nothing can get around.
#pragma once

#include "devices/device.hpp"

namespace tandem {

/// Clamps to the device's software limits with the direction kept, and writes.
///
/// Thread  haptic
class DeviceWriter {
 public:
  /// Fails   std::invalid_argument when a limit of the spec is not finite, negative, or above its verified maximum
  explicit DeviceWriter(Device& device);
  /// Writes the clamped wrench (zero when not finite). Returns false when the device did not take it.
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept;
  void write_zero(LocalTime now) noexcept { write(now, Wrench{}); }
  /// What was last written, after the clamp, and whether the clamp changed it.
  const Wrench& written() const { return written_; }
  bool was_clamped() const { return was_clamped_; }

 private:
  Device& device_;
  Wrench written_;
  bool was_clamped_ = false;
};

}  // namespace tandem
