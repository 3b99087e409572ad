// A simulated hand on a simulated device: the project's device for tests, the lab, and laptops without one.
#pragma once

#include <cstdint>

#include "common/base/random.hpp"
#include "common/haptics/velocity_estimator.hpp"
#include "devices/device.hpp"
#include "devices/sim/hand_path.hpp"

namespace tandem::devices {

/// The hand and the device it holds, as one mass–damper–spring in each of six directions.
///
/// Model   m ẍ = K (x_intended − x) + B (ẋ_intended − ẋ) + f_device + tremor, likewise in rotation; integrated
///         exactly enough (leapfrog, sub-steps ≤ 0.1 ms; damping as its exponential, so any is stable) with the
///         device's force held between writes
/// Source  0.3 kg and 200 N/m: a light grip, the values behind the project's delay studies. The damping ratio, 0.37,
///         is that of the typical trial in "Haptic perception of force magnitude and its relation to postural arm
///         dynamics in 3D", Scientific Reports 5, 18004 (2015), fig. 3: 0.554 kg, 6.45 N·s/m, 135 N/m.
///         The rotational triple is ours: a stylus-sized handle, 7 Hz, damping ratio 0.56
struct HandParameters {
  double mass_kg = 0.3;
  double stiffness_n_per_m = 200.0;
  double damping_n_s_per_m = 5.8;
  double inertia_kg_m2 = 4e-4;
  double stiffness_n_m_per_rad = 0.8;
  double damping_n_m_s_per_rad = 0.02;
  double tremor_rms_n = 0.0;  ///< force, narrow band around tremor_hz
  double tremor_hz = 9.0;
  /// Quantisation of the reported position; 0: none. With it the reported velocity is that of the positions
  /// (VelocityEstimator), as of a device that has nothing else.
  double encoder_step_m = 0.0;
  double encoder_step_rad = 0.0;
};

/// Device `sim`. read(now) advances the hand to `now` under the force last written.
class SimDevice final : public Device {
 public:
  /// The hand starts at rest at the path's first pose; path time starts at the first read.
  SimDevice(DeviceSpec spec, const HandParameters& hand, HandPath path, std::uint64_t seed);
  /// The spec of `sim`: 6 axes, limits of a mid-range desktop device, sources named; that of the profile of this name.
  static DeviceSpec default_spec();

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample read(LocalTime now) noexcept override;
  bool write(LocalTime now, const DeviceCommand& command) noexcept override;

  /// Keeps the hand at the path's first way point until start_path(); for hands that shall start together.
  void hold_path() noexcept { is_path_held_ = true; }
  /// Path time is 0 at `now` and runs from there.
  void start_path(LocalTime now) noexcept;

  const HandPath& path() const { return path_; }
  /// Path time of the last read.
  Duration path_time() const noexcept { return path_time_; }
  /// The true (not quantised) state of the hand, in D.
  const Pose& hand_pose() const { return X_DH_; }
  const Twist& hand_twist() const { return V_DH_; }

 private:
  void advance(double dt_s) noexcept;
  Duration path_time_at(LocalTime time) const noexcept;
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
  bool is_path_held_ = false;
  Duration path_time_{0};
  Pose X_DH_;
  Twist V_DH_;
  Wrench force_on_hand_D_;
  Vec3 tremor_state_ = Vec3::Zero();
  Vec3 tremor_rate_ = Vec3::Zero();
};

}  // namespace tandem::devices
