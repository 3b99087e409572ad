// A simulated hand on a simulated device: the project's device for tests, the lab, and laptops without one.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/base/random.hpp"
#include "common/haptics/velocity_estimator.hpp"
#include "devices/device.hpp"
#include "devices/hand_dynamics.hpp"
#include "devices/sim/hand_path.hpp"

namespace tandem::devices {

/// The hand of HandParameters on a device that is always ready. read(now) advances the hand to `now` under the last
/// written force. DeviceSpec::workspace_m, if set, defines mechanical stops.
class SimDevice final : public Device {
 public:
  /// The hand starts at rest at the path's first pose. Path time starts at the first read, unless begin_path_at() has
  /// set another time.
  SimDevice(DeviceSpec spec, const HandParameters& hand, HandPath path, std::uint64_t seed);
  /// The spec of `sim`: 6 axes, limits of a mid-range desktop device with sources; equal to the profile of this name.
  static DeviceSpec default_spec();

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample read(LocalTime now) noexcept override;
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;

  /// Simulates a user who watches an object that moves with the hand and guides it along the path. Called once a tick.
  /// The intended pose is path / scale − offset, within the device's reach. The remaining visible error is corrected
  /// with a time constant of 0.2 s, by at most 10 mm.
  void steer(const Vec3& offset_m, double scale) noexcept;
  /// In      start  LocalTime::max(): the hand rests until the next call
  void begin_path_at(LocalTime start) noexcept override;

  const HandPath& path() const { return path_; }
  /// Path time of the last read; negative before the start.
  Duration path_time() const noexcept { return path_time_; }
  /// The true (not quantised) state of the hand, in D.
  const Pose& hand_pose() const { return hand_motion_.pose(); }
  const Twist& hand_twist() const { return hand_motion_.twist(); }

 private:
  void advance(double dt_s) noexcept;
  RigidState intended(double dt_s) const noexcept;
  Vec3 stop_force() const noexcept;
  Duration path_time_at(LocalTime time) const noexcept { return time - started_; }
  /// Path time for evaluation; the beginning of the path before its start.
  Duration place_on_path() const noexcept { return std::max(path_time_, Duration(0)); }
  Vec3 tremor_force(double dt_s) noexcept;
  Twist reported_twist(LocalTime now, const Pose& reported) noexcept;
  Pose quantised(const Pose& X) const noexcept;

  DeviceSpec spec_;
  HandParameters hand_;
  HandPath path_;
  Random random_;
  haptics::VelocityEstimator estimator_;
  LocalTime started_{};
  LocalTime last_read_{};
  bool has_started_ = false;
  bool is_start_set_ = false;
  Duration path_time_{0};
  HandDynamics hand_motion_;
  Wrench force_on_hand_D_;
  Vec3 offset_m_ = Vec3::Zero();  ///< see steer()
  Vec3 offset_rate_m_per_s_ = Vec3::Zero();
  Vec3 made_up_m_ = Vec3::Zero();
  double scale_ = 1;
  Vec3 tremor_state_ = Vec3::Zero();
  Vec3 tremor_rate_ = Vec3::Zero();
};

}  // namespace tandem::devices
