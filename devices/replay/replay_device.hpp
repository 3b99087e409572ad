// A hand that was recorded moves again.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "devices/device.hpp"

namespace tandem::devices {

/// Goes where the recorded hand went, in its time, whatever force it is shown.
///
/// Model   between two samples of which both are valid, at most kMaxGap apart, position and twist go evenly and the
///         rotation by slerp; else the earlier one is held. Buttons are those of the earlier
/// Limits  behind the last sample the device is lost: nothing moves any more, and the force is let go
class ReplayDevice final : public Device {
 public:
  static constexpr Duration kMaxGap = std::chrono::milliseconds(50);

  /// In      samples  at least one; `taken` grows, and counts from any instant. The reason of the last one, a literal, is why
  ///                  nothing follows; empty: the recording is over
  ReplayDevice(DeviceSpec spec, std::shared_ptr<const std::vector<DeviceSample>> samples);

  const DeviceSpec& spec() const noexcept override { return spec_; }
  /// The recording begins at the first read, unless begin_path_at() has set another time.
  DeviceSample read(LocalTime now) noexcept override;
  void begin_path_at(LocalTime start) noexcept override;
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;

 private:
  DeviceSpec spec_;
  std::shared_ptr<const std::vector<DeviceSample>> samples_;
  std::string_view ending_ = "the recording is over";
  std::size_t at_ = 0;  ///< the last that was due
  bool is_start_set_ = false;
  LocalTime started_{};
};

}  // namespace tandem::devices
