// Playback of a recorded hand motion.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "devices/device.hpp"

namespace tandem::devices {

/// Follows the recorded motion of a hand with the original timing. The force has no effect on the motion.
///
/// Model   If two successive samples are valid and at most kMaxGap apart, the state between them is interpolated:
///         position and twist linearly, the rotation by slerp. Otherwise the earlier sample is held. The buttons are
///         always those of the earlier sample
/// Limits  after the last sample, the device is reported as lost, with the hand at rest; no force is displayed
class ReplayDevice final : public Device {
 public:
  static constexpr Duration kMaxGap = std::chrono::milliseconds(50);

  /// In      samples  recorded samples, at least one. Their times `taken` must increase and may have any origin. The
  ///                  `reason` of the last sample (a string literal) states why the recording ends there; empty: the
  ///                  recording is complete
  ReplayDevice(DeviceSpec spec, std::shared_ptr<const std::vector<DeviceSample>> samples);

  const DeviceSpec& spec() const noexcept override { return spec_; }
  /// Reads a sample. The recording starts at the first read, unless begin_path_at() has set a start time.
  DeviceSample read(LocalTime now) noexcept override;
  void begin_path_at(LocalTime start) noexcept override;
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;

 private:
  DeviceSpec spec_;
  std::shared_ptr<const std::vector<DeviceSample>> samples_;
  std::string_view ending_ = "the recording is over";
  std::size_t at_ = 0;  ///< index of the last due sample
  bool is_start_set_ = false;
  LocalTime started_{};
};

}  // namespace tandem::devices
