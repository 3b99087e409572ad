#include "devices/hand_dynamics.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace tandem::devices {
namespace {

void check(bool is_good, const char* field, double value, const char* remedy) {
  if (is_good) return;
  throw std::invalid_argument(std::string("simulated hand: ") + field + " is " + std::to_string(value) +
                              "; it must be " + remedy);
}

bool is_at_least_zero(double value) {
  return std::isfinite(value) && value >= 0;
}

// Returns whether the integration is accurate at its largest time step h. ω is the natural frequency √(stiffness /
// inertia). The integration is stable for ω·h < 2; for ω·h < 0.3 its frequency is accurate to 0.4 %.
bool can_be_stepped(double stiffness, double inertia) {
  return std::sqrt(stiffness / inertia) * HandDynamics::kMaxStep_s < 0.3;
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

/// Effect of a damper over one time step under a constant force: the fraction of the speed that remains, and the speed
/// gained per newton.
struct Decay {
  double kept;
  double speed_per_force;
};

Decay decay_of(double damping, double inertia, double dt_s) {
  if (damping <= 0) return {1, dt_s / inertia};
  const double lost = -std::expm1(-damping / inertia * dt_s);
  return {1 - lost, lost / damping};
}

}  // namespace

HandDynamics::HandDynamics(const HandParameters& hand, const Pose& X_DH) : hand_(hand), X_DH_(X_DH) {
  check_parameters(hand_);
}

// Advances the hand by one time step h, in three parts: half a step of motion, the change of speed by the force at that
// position, and the second half of the motion. Under a constant force, position and speed are exact. The stiffest
// spring that remains stable is therefore the same as for the physical system.
// The change of speed solves the equation of the damper exactly for a constant force, which is stable for any damping:
//   v⁺ = d v + (1 − d) (K e + B v_intended + f) / B  with  d = e^(−h B/m)
// v, v⁺: speed before and after the step; m: mass; B: damping; K: stiffness; e: distance to the intended position;
// f: force of the device
void HandDynamics::advance(const Pose& intended, const Twist& intended_rate, const Wrench& on_hand_D,
                           const Vec3& more_D, double dt_s) noexcept {
  X_DH_ = integrate(X_DH_, V_DH_, dt_s / 2);

  const Vec3 force = hand_.stiffness_n_per_m * (intended.p - X_DH_.p) + hand_.damping_n_s_per_m * intended_rate.v +
                     on_hand_D.f + more_D;
  const Decay decay = decay_of(hand_.damping_n_s_per_m, hand_.mass_kg, dt_s);
  V_DH_.v = decay.kept * V_DH_.v + decay.speed_per_force * force;

  const Vec3 turn = rotation_vector(intended.q * X_DH_.q.conjugate());
  const Vec3 torque = hand_.stiffness_n_m_per_rad * turn + hand_.damping_n_m_s_per_rad * intended_rate.w + on_hand_D.t;
  const Decay turning = decay_of(hand_.damping_n_m_s_per_rad, hand_.inertia_kg_m2, dt_s);
  V_DH_.w = turning.kept * V_DH_.w + turning.speed_per_force * torque;

  X_DH_ = integrate(X_DH_, V_DH_, dt_s / 2);
}

}  // namespace tandem::devices
