// A SpaceMouse as a device without force: the deflection of its cap, a few millimetres, moves a handle.
#pragma once

#include <memory>
#include <string_view>

#include "devices/spacemouse/hid_port.hpp"
#include "devices/spacemouse/space_mouse_reports.hpp"
#include "devices/threaded_device.hpp"

namespace tandem::devices {

/// Effect of the cap's deflection.
enum class CapControl : std::uint8_t {
  kRate,  ///< velocity of the handle: up to 0.15 m/s and 1 rad/s, within ±0.2 m
  kPose   ///< pose of the handle: up to 0.04 m and 0.5 rad from the centre
};

/// Driver of a SpaceMouse.
///
/// Model   reports arrive at 62 to 125 Hz. Their deflection u passes a critically damped filter, ẍ = ω² (u − x) − 2ω ẋ,
///         ω = 60 rad/s, each millisecond, exact for constant u: the handle's velocity has no step. Absence of
///         reports means rest: a deflected cap reports continuously, a released one stops. After 150 ms without a
///         report, that of the release was lost, and the cap counts as at rest.
/// Thread  the device's
class SpaceMouseDriver final : public DeviceDriver {
 public:
  /// In      port  may be null; then step() opens it, as after an unplugging
  SpaceMouseDriver(CapControl control, OpenHid open, std::unique_ptr<HidPort> port);
  /// Switches the light off.
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
  Vec6 cap_rate_ = Vec6::Zero();  ///< derivative of cap_, per second
  Pose X_DH_;
  Twist V_DH_;
};

}  // namespace tandem::devices
