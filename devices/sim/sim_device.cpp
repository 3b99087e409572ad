#include "devices/sim/sim_device.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace tandem::devices {
namespace {

constexpr double kMaxSubStep_s = 1e-4;
/// A reader that comes back later than this finds the hand where it was then; bounds the work of one read().
constexpr Duration kMaxAdvance = std::chrono::seconds(1);
/// Width of the tremor's band as a damping ratio. Ours: about ±1 Hz at 9 Hz, as wide as tremor spectra look.
constexpr double kTremorDampingRatio = 0.1;

void check(bool is_good, const char* field, double value, const char* remedy) {
  if (is_good) return;
  throw std::invalid_argument(std::string("simulated hand: ") + field + " is " + std::to_string(value) +
                              "; it must be " + remedy);
}

bool is_at_least_zero(double value) {
  return std::isfinite(value) && value >= 0;
}

// The steps are stable while ω·h < 2; below 0.3 their frequency is right to 0.4 %.
bool can_be_stepped(double stiffness, double inertia) {
  return std::sqrt(stiffness / inertia) * kMaxSubStep_s < 0.3;
}

void check_parameters(const HandParameters& hand) {
  check(std::isfinite(hand.mass_kg) && hand.mass_kg > 0, "mass_kg", hand.mass_kg, "above 0");
  check(std::isfinite(hand.inertia_kg_m2) && hand.inertia_kg_m2 > 0, "inertia_kg_m2", hand.inertia_kg_m2, "above 0");
  check(is_at_least_zero(hand.damping_n_s_per_m), "damping_n_s_per_m", hand.damping_n_s_per_m, "0 or more");
  check(is_at_least_zero(hand.damping_n_m_s_per_rad), "damping_n_m_s_per_rad", hand.damping_n_m_s_per_rad, "0 or more");
  check(is_at_least_zero(hand.tremor_rms_n), "tremor_rms_n", hand.tremor_rms_n, "0 or more");
  check(hand.tremor_hz > 0 && hand.tremor_hz <= 100, "tremor_hz", hand.tremor_hz, "above 0, at most 100");
  check(is_at_least_zero(hand.encoder_step_m), "encoder_step_m", hand.encoder_step_m, "0 or more");
  check(is_at_least_zero(hand.encoder_step_rad), "encoder_step_rad", hand.encoder_step_rad, "0 or more");
  check(is_at_least_zero(hand.stiffness_n_per_m) && can_be_stepped(hand.stiffness_n_per_m, hand.mass_kg),
        "stiffness_n_per_m", hand.stiffness_n_per_m, "0 or more, and sqrt(stiffness / mass) below 3000 rad/s");
  check(is_at_least_zero(hand.stiffness_n_m_per_rad) && can_be_stepped(hand.stiffness_n_m_per_rad, hand.inertia_kg_m2),
        "stiffness_n_m_per_rad", hand.stiffness_n_m_per_rad,
        "0 or more, and sqrt(stiffness / inertia) below 3000 rad/s");
}

/// What a damper leaves of a speed after a while, and how much speed a force then has given.
struct Decay {
  double kept;
  double speed_per_force;
};

Decay decay_of(double damping, double inertia, double dt_s) {
  if (damping <= 0) return {1, dt_s / inertia};
  const double lost = -std::expm1(-damping / inertia * dt_s);
  return {1 - lost, lost / damping};
}

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
      X_DH_(path_.pose_at(Duration(0))) {
  spec_.position_step_m = hand.encoder_step_m;
  spec_.rotation_step_rad = hand.encoder_step_rad;
  check_parameters(hand_);
  // The tremor is under way from the first sample: its state is drawn from the stationary distribution.
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
  // Here and not read from the profile "sim", so that a program needs no file for it; a test holds the two together.
  // Sized like an existing desktop device with torque; of its three torque axes the weakest counts.
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
    started_ = last_read_ = now;
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
  sample.X_DH = quantised(X_DH_);
  sample.V_DH = reported_twist(now, sample.X_DH);
  sample.buttons = path_.buttons_at(path_time_);
  return sample;
}

void SimDevice::start_path(LocalTime now) noexcept {
  read(now);
  is_path_held_ = false;
  started_ = now;
  path_time_ = Duration(0);
}

Duration SimDevice::path_time_at(LocalTime time) const noexcept {
  return is_path_held_ ? Duration(0) : time - started_;
}

bool SimDevice::write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept {
  // The hand moves under the old force until now, whoever calls first.
  if (has_started_ && now > last_read_) read(now);
  if (!is_finite(wrench_on_hand_D)) return false;
  force_on_hand_D_ = wrench_on_hand_D;
  return true;
}

// Half of the way, the force there, the other half: exact in position and speed under a held force alone, which decides
// how stiff a sampled spring may be. The damper acts for the whole sub-step while the force is held,
// v⁺ = e^(−h B/m) v + (1 − e^(−h B/m)) (K e + B v_intended + f)/B, so that no damping is too much for the sub-steps.
void SimDevice::advance(double dt_s) noexcept {
  const Pose intended = path_.pose_at(path_time_);
  const Twist intended_rate = path_.twist_at(path_time_);
  X_DH_ = integrate(X_DH_, V_DH_, dt_s / 2);

  const Vec3 force = hand_.stiffness_n_per_m * (intended.p - X_DH_.p) + hand_.damping_n_s_per_m * intended_rate.v +
                     force_on_hand_D_.f + tremor_force(dt_s);
  const Decay decay = decay_of(hand_.damping_n_s_per_m, hand_.mass_kg, dt_s);
  V_DH_.v = decay.kept * V_DH_.v + decay.speed_per_force * force;

  const Vec3 turn = rotation_vector(intended.q * X_DH_.q.conjugate());
  const Vec3 torque =
      hand_.stiffness_n_m_per_rad * turn + hand_.damping_n_m_s_per_rad * intended_rate.w + force_on_hand_D_.t;
  const Decay turning = decay_of(hand_.damping_n_m_s_per_rad, hand_.inertia_kg_m2, dt_s);
  V_DH_.w = turning.kept * V_DH_.w + turning.speed_per_force * torque;

  X_DH_ = integrate(X_DH_, V_DH_, dt_s / 2);
}

// White noise through a resonator: ẍ + 2ζω ẋ + ω² x = w; with ⟨w w'⟩ = S δ the variance of x is S / (4ζω³).
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
  Twist result = V_DH_;
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
