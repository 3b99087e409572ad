// A simulated hand on a simulated device, for tests, for the lab, and for machines without a haptic device.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/base/random.hpp"
#include "common/haptics/velocity_estimator.hpp"
#include "devices/device.hpp"
#include "devices/hand_dynamics.hpp"
#include "devices/sim/hand_path.hpp"

namespace tandem::devices {

/// Simulates a hand with HandParameters on a device that is always ready. read(now) advances the simulation to `now`
/// under the last written force. If DeviceSpec::workspace_m is set, mechanical stops limit the motion.
class SimDevice final : public Device {
 public:
  /// Starts the hand at rest at the first pose of the path. The path starts at the first read, unless begin_path_at()
  /// has set a start time.
  SimDevice(DeviceSpec spec, const HandParameters& hand, HandPath path, std::uint64_t seed);
  /// Returns the spec of `sim`: 6 axes, and the limits of a mid-range desktop device with their sources. It equals the
  /// profile "sim".
  static DeviceSpec default_spec();

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample read(LocalTime now) noexcept override;
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;

  /// Simulates a user who watches an object that moves with the hand, and guides this object along the path. Must be
  /// called once per tick.
  /// The intended position of the hand is path / scale − offset, limited to the device's workspace. The user sees the
  /// error that remains, and corrects it with a time constant of 0.2 s, by at most 10 mm.
  void steer(const Vec3& offset_m, double scale) noexcept;
  /// In      start  start time of the path; LocalTime::max(): not known yet, a later call sets it
  void begin_path_at(LocalTime start) noexcept override;

  const HandPath& path() const { return path_; }
  /// Returns the path time of the last read; negative before the path has started.
  Duration path_time() const noexcept { return path_time_; }
  /// Returns the exact state of the hand in D, without quantisation.
  const Pose& hand_pose() const { return hand_motion_.pose(); }
  const Twist& hand_twist() const { return hand_motion_.twist(); }

 private:
  void advance(double dt_s) noexcept;
  RigidState intended(double dt_s) const noexcept;
  Vec3 stop_force() const noexcept;
  Duration path_time_at(LocalTime time) const noexcept { return time - started_; }
  /// Returns the time for which the path is evaluated: path_time_, but 0 before the path has started.
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
  Vec3 offset_m_ = Vec3::Zero();  ///< last offset passed to steer()
  Vec3 offset_rate_m_per_s_ = Vec3::Zero();
  Vec3 made_up_m_ = Vec3::Zero();
  double scale_ = 1;
  Vec3 tremor_state_ = Vec3::Zero();
  Vec3 tremor_rate_ = Vec3::Zero();
};

}  // namespace tandem::devices
