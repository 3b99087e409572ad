#include "devices/sim/sim_device.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace tandem::devices {
namespace {

constexpr double kMaxSubStep_s = HandDynamics::kMaxStep_s;
/// Maximum time that one read() simulates, which limits the cost of the call. After a longer pause, the rest is
/// skipped.
constexpr Duration kMaxAdvance = std::chrono::seconds(1);
constexpr double kTick_s = 0.001;
constexpr double kStop_n_per_m = 5000;
constexpr double kEye_s = 0.2, kMaxMadeUp_m = 0.01;
/// Damping ratio of the tremor, which determines its bandwidth. At 9 Hz it gives about ±1 Hz, similar to measured
/// tremor spectra; our choice.
constexpr double kTremorDampingRatio = 0.1;

Vec3 rounded_to(const Vec3& a, double step) {
  if (step <= 0) return a;
  return (a / step).array().round().matrix() * step;
}

}  // namespace

SimDevice::SimDevice(DeviceSpec spec, const HandParameters& hand, HandPath path, std::uint64_t seed)
    : spec_(std::move(spec)),
      hand_(hand),
      path_(std::move(path)),
      random_(seed),
      estimator_(hand.encoder_step_m, hand.encoder_step_rad),
      hand_motion_(hand, path_.pose_at(Duration(0))) {
  spec_.position_step_m = hand.encoder_step_m;
  spec_.rotation_step_rad = hand.encoder_step_rad;
  // The initial state is drawn from the stationary distribution of the tremor. Its RMS value is then correct from the
  // first sample on.
  const double omega = 2 * std::numbers::pi * hand_.tremor_hz;
  const double axis_rms_n = hand_.tremor_rms_n / std::sqrt(3.0);
  for (int i = 0; i < 3; ++i) {
    tremor_state_[i] = axis_rms_n * random_.normal();
    tremor_rate_[i] = axis_rms_n * omega * random_.normal();
  }
}

DeviceSpec SimDevice::default_spec() {
  DeviceSpec spec;
  spec.name = "sim";
  spec.actuated_rotations = 3;
  // Equal to the profile "sim" (checked by a test), but repeated here so that programs need no profile file. The values
  // are those of an existing desktop device with torque. The torque is that of the device's weakest axis.
  spec.force_maximum_n = {8.5, "Phantom Premium 1.5/6DOF: Hou, PhD thesis, NTU 2014, table A.1"};
  spec.torque_maximum_n_m = {0.17, "Phantom Premium 1.5/6DOF, roll: Hou, PhD thesis, NTU 2014, table A.1"};
  spec.force_limit_n = 7.0;
  spec.torque_limit_n_m = 0.17;
  spec.reach_m = 1.5 * Vec3(0.381, 0.267, 0.191).norm();
  return spec;
}

DeviceSample SimDevice::read(LocalTime now) noexcept {
  if (!has_started_) {
    has_started_ = true;
    last_read_ = now;
    if (!is_start_set_) started_ = now;
    path_time_ = path_time_at(now);
  }
  if (now > last_read_) {
    const Duration span = std::min(now - last_read_, kMaxAdvance);
    const auto steps = static_cast<int>(std::ceil(to_seconds(span) / kMaxSubStep_s - 1e-9));
    const double dt_s = to_seconds(span) / steps;
    for (int i = 1; i <= steps; ++i) {
      path_time_ = path_time_at(last_read_ + span * (2 * i - 1) / (2 * steps));
      advance(dt_s);
    }
    path_time_ = path_time_at(now);
    last_read_ = now;
  }
  DeviceSample sample;
  sample.taken = now;
  sample.state = DeviceState::kReady;
  sample.is_valid = true;
  sample.X_DH = quantised(hand_motion_.pose());
  sample.V_DH = reported_twist(now, sample.X_DH);
  sample.buttons = path_.buttons_at(place_on_path());
  sample.path_time = path_time_;
  return sample;
}

void SimDevice::begin_path_at(LocalTime start) noexcept {
  is_start_set_ = true;
  started_ = start;
  if (has_started_) path_time_ = path_time_at(last_read_);
}

bool SimDevice::write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept {
  // Simulates the hand up to `now` under the previous force. The result is then independent of the order of read() and
  // write() within a tick.
  if (has_started_ && now > last_read_) read(now);
  if (!is_finite(wrench_on_hand_D)) return false;
  force_on_hand_D_ = wrench_on_hand_D;
  return true;
}

void SimDevice::advance(double dt_s) noexcept {
  const RigidState aim = intended(dt_s);
  hand_motion_.advance(aim.X, aim.V, force_on_hand_D_, tremor_force(dt_s) + stop_force(), dt_s);
}

void SimDevice::steer(const Vec3& offset_m, double scale) noexcept {
  if (!is_finite(offset_m)) return;
  offset_rate_m_per_s_ = (offset_m - offset_m_) / kTick_s;
  offset_m_ = offset_m;
  scale_ = scale;
  const Vec3 missing = path_.pose_at(place_on_path()).p / scale_ - offset_m_ - hand_motion_.pose().p;
  made_up_m_ = clamped_to_length(made_up_m_ + kTick_s / kEye_s * missing, kMaxMadeUp_m);
}

RigidState SimDevice::intended(double dt_s) const noexcept {
  // The intended pose of a relaxed hand is its own pose, so its spring exerts no force. It is extrapolated by half a
  // step, because HandDynamics evaluates the spring in the middle of a step.
  if (path_.is_relaxed_at(place_on_path()))
    return {integrate(hand_motion_.pose(), hand_motion_.twist(), dt_s / 2), Twist{}};
  RigidState aim{path_.pose_at(place_on_path()), path_.twist_at(place_on_path())};
  aim.X.p = aim.X.p / scale_ - offset_m_ + made_up_m_;
  aim.V.v = aim.V.v / scale_ - offset_rate_m_per_s_;
  const Vec3 half = spec_.workspace_m / 2;
  for (int i = 0; i < 3; ++i) {
    if (half[i] <= 0 || std::abs(aim.X.p[i]) <= half[i]) continue;
    aim.X.p[i] = std::clamp(aim.X.p[i], -half[i], half[i]);
    aim.V.v[i] = 0;
  }
  return aim;
}

/// Returns the force of the device's mechanical stops.
Vec3 SimDevice::stop_force() const noexcept {
  const Vec3 half = spec_.workspace_m / 2;
  if (half.isZero(0)) return Vec3::Zero();
  const Vec3& p = hand_motion_.pose().p;
  return kStop_n_per_m * (p.cwiseMin(half).cwiseMax(-half) - p);
}

// The tremor x is white noise w filtered by a resonator: ẍ + 2ζω ẋ + ω² x = w.
// - ω: angular frequency of the tremor
// - ζ: damping ratio
// - S: spectral density of w, defined by ⟨w w'⟩ = S δ
// The variance of x is S / (4ζω³). S is chosen so that the RMS value is the given one.
Vec3 SimDevice::tremor_force(double dt_s) noexcept {
  if (hand_.tremor_rms_n <= 0) return Vec3::Zero();
  const double omega = 2 * std::numbers::pi * hand_.tremor_hz;
  const double axis_variance = hand_.tremor_rms_n * hand_.tremor_rms_n / 3;
  const double kick = std::sqrt(axis_variance * 4 * kTremorDampingRatio * omega * omega * omega * dt_s);
  const Vec3 noise(random_.normal(), random_.normal(), random_.normal());
  tremor_rate_ +=
      kick * noise - dt_s * (2 * kTremorDampingRatio * omega * tremor_rate_ + omega * omega * tremor_state_);
  tremor_state_ += dt_s * tremor_rate_;
  return tremor_state_;
}

Twist SimDevice::reported_twist(LocalTime now, const Pose& reported) noexcept {
  Twist result = hand_motion_.twist();
  if (hand_.encoder_step_m <= 0 && hand_.encoder_step_rad <= 0) return result;
  const Twist estimate = estimator_.add(now, reported);
  if (hand_.encoder_step_m > 0) result.v = estimate.v;
  if (hand_.encoder_step_rad > 0) result.w = estimate.w;
  return result;
}

Pose SimDevice::quantised(const Pose& X) const noexcept {
  Pose result = X;
  result.p = rounded_to(X.p, hand_.encoder_step_m);
  if (hand_.encoder_step_rad > 0) {
    result.q = quaternion_of(rounded_to(rotation_vector(X.q), hand_.encoder_step_rad));
  }
  return result;
}

}  // namespace tandem::devices
