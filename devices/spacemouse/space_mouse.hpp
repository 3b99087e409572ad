// A SpaceMouse as a device: it shows no force, and its cap, which is deflected by a few millimetres, moves a handle.
#pragma once

#include <memory>
#include <string_view>

#include "devices/spacemouse/hid_port.hpp"
#include "devices/spacemouse/space_mouse_reports.hpp"
#include "devices/threaded_device.hpp"

namespace tandem::devices {

/// What the deflection of the cap is.
enum class CapControl : std::uint8_t {
  kRate,  ///< the handle's velocity: up to 0.15 m/s and 1 rad/s, within ±0.2 m
  kPose   ///< the handle's place: up to 0.04 m and 0.5 rad from the middle
};

/// Model   reports come at 62 to 125 Hz; the deflection u that they tell goes through a critically damped filter,
///         ẍ = ω² (u − x) − 2ω ẋ, ω = 60 rad/s, each millisecond, exact for u held: the handle's velocity has no step.
///         No report is rest, for a cap that is let go soon falls silent. One that is deflected reports all the time: after
///         150 ms without a report the last one, of the release, was lost, and the cap is at rest.
/// Thread  the device's
class SpaceMouseDriver final : public DeviceDriver {
 public:
  /// The port may be null: then it is opened with the steps, as after it was unplugged.
  SpaceMouseDriver(CapControl control, OpenHid open, std::unique_ptr<HidPort> port);
  /// The light goes out.
  ~SpaceMouseDriver() override;
  SpaceMouseDriver(const SpaceMouseDriver&) = delete;
  SpaceMouseDriver& operator=(const SpaceMouseDriver&) = delete;

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) override;
  bool may_be_on() const noexcept override { return false; }

 private:
  DeviceSample absent(LocalTime now);
  void light(bool is_on);
  bool take_report(LocalTime now);
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
  Vec6 cap_ = Vec6::Zero();       ///< deflection, filtered
  Vec6 cap_rate_ = Vec6::Zero();  ///< per second
  Pose X_DH_;
  Twist V_DH_;
};

}  // namespace tandem::devices
