// A SpaceMouse as an input device that cannot display forces. Deflecting its cap by a few millimetres moves a virtual
// handle.
#pragma once

#include <memory>
#include <string_view>

#include "devices/spacemouse/hid_port.hpp"
#include "devices/spacemouse/space_mouse_reports.hpp"
#include "devices/threaded_device.hpp"

namespace tandem::devices {

/// Quantity that the deflection of the cap controls.
enum class CapControl : std::uint8_t {
  kRate,  ///< velocity of the handle, up to 0.15 m/s and 1 rad/s; the handle stays within ±0.2 m
  kPose   ///< pose of the handle, up to 0.04 m and 0.5 rad from its centre pose
};

/// Driver of a SpaceMouse.
///
/// Model   Reports arrive at 62 to 125 Hz, each with the deflection u of the cap. A filter smooths u, so that the
///         velocity of the handle has no steps: ẍ = ω² (u − x) − 2ω ẋ, with the output x and ω = 60 rad/s (critically
///         damped). The filter is computed once per millisecond, exactly for constant u.
///         Lost reports: a deflected cap sends reports continuously, and a released cap stops after a report of zero.
///         If no report arrives for 150 ms, that report was lost, and the deflection is set to zero.
/// Thread  the thread of the device
class SpaceMouseDriver final : public DeviceDriver {
 public:
  /// In      port  an open port; null: the first step() opens a port, as it does after unplugging
  SpaceMouseDriver(CapControl control, OpenHid open, std::unique_ptr<HidPort> port);
  /// Switches the light of the device off.
  ~SpaceMouseDriver() override;
  SpaceMouseDriver(const SpaceMouseDriver&) = delete;
  SpaceMouseDriver& operator=(const SpaceMouseDriver&) = delete;

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) override;
  bool may_be_on() const noexcept override { return false; }

 private:
  DeviceSample absent(LocalTime now);
  void light(bool is_on);
  bool read_report(LocalTime now);
  void move(LocalTime now);
  Pose next_pose(double dt_s);

  DeviceSpec spec_;
  CapControl control_;
  OpenHid open_;
  std::unique_ptr<HidPort> port_;
  Absence absence_;
  SpaceMouseReports reports_;
  LocalTime reported_{};
  LocalTime moved_{};
  bool has_moved_ = false;
  Vec6 cap_ = Vec6::Zero();       ///< filtered deflection
  Vec6 cap_rate_ = Vec6::Zero();  ///< derivative of cap_ [1/s]
  Pose X_DH_;
  Twist V_DH_;
};

}  // namespace tandem::devices
