// Random states, parameters and closed paths of the handle for tests of coupling laws.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/coupling/sampled_loop.hpp"

namespace tandem::haptics {

inline Vec3 random_vector(Random& random, double scale) {
  return {random.uniform(-scale, scale), random.uniform(-scale, scale), random.uniform(-scale, scale)};
}

/// Returns a random number whose logarithm is uniformly distributed between the bounds.
inline double random_magnitude(Random& random, double low, double high) {
  return std::exp(random.uniform(std::log(low), std::log(high)));
}

/// Returns random parameters within the limits of scenes. With the random states, they reach every section of each
/// curve.
inline CouplingParameters random_parameters(Random& random) {
  CouplingParameters c;
  c.stiffness_n_per_m = random_magnitude(random, 10, 3000);
  c.damping_n_s_per_m = random_magnitude(random, 0.1, 10);
  c.stiffness_n_m_per_rad = random_magnitude(random, 0.05, 5);
  c.damping_n_m_s_per_rad = random_magnitude(random, 1e-4, 0.05);
  c.force_limit_n = random_magnitude(random, 0.5, 40);
  c.torque_limit_n_m = random_magnitude(random, 0.02, 3);
  c.saturation_softness = random.uniform(0.05, 1);
  c.curve_sharpness = random_magnitude(random, 0.3, 3);
  return c;
}

/// Returns an invalid or extreme number (NaN, infinity) or an ordinary one, as a faulty device or packet may contain.
inline double hostile_number(Random& random) {
  constexpr std::array kHostile{std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity(),
                                -std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::max(),
                                -1e300,
                                std::numeric_limits<double>::denorm_min(),
                                -0.0,
                                0.0};
  const std::uint32_t pick = random.next_u32() % (2 * kHostile.size());
  if (pick < kHostile.size()) return kHostile.at(pick);
  return random.uniform(-1, 1) * std::pow(10.0, random.uniform(-310, 308));
}

inline Vec3 hostile_vector(Random& random) {
  const double x = hostile_number(random), y = hostile_number(random), z = hostile_number(random);
  return {x, y, z};
}

inline LoopModel random_model(Random& random) {
  const auto spread = [&](double low, double high) { return low * std::pow(high / low, random.uniform()); };
  LoopModel m;
  m.period_s = spread(2.5e-4, 4e-3);
  m.stiffness = spread(50, 5000);
  m.damping = random.uniform() < 0.2 ? 0 : spread(0.1, 20);
  m.tool_mass = random.uniform() < 0.2 ? 0 : spread(0.02, 2);
  m.device_mass = spread(0.05, 0.5);
  m.device_damping = spread(0.05, 5);
  const bool is_held = random.uniform() < 0.7;
  m.hand_mass = is_held ? spread(0.1, 1) : 0;
  m.hand_stiffness = is_held ? spread(50, 1000) : 0;
  m.hand_damping = is_held ? spread(1, 20) : 0;
  m.contact_stiffness = random.uniform() < 0.5 ? 0 : spread(1000, 50000);
  m.velocity_window = 1 + static_cast<int>(random.uniform() * 10);
  m.delay_periods = static_cast<int>(random.uniform() * 4);
  return m;
}

inline CouplingState hostile_state(Random& random) {
  CouplingState state;
  for (Vec3 CouplingState::*part : {&CouplingState::d_W, &CouplingState::theta_W, &CouplingState::v_W,
                                    &CouplingState::w_W, &CouplingState::v_WH, &CouplingState::w_WH}) {
    state.*part = hostile_vector(random);
  }
  return state;
}

/// A random smooth closed curve in space with the parameter s from 0 to 1. It is about `scale` wide.
class Loop {
 public:
  Loop(Random& random, double scale) {
    for (Vec3& amplitude : amplitudes_) amplitude = random_vector(random, scale / 3);
  }
  Vec3 operator()(double s) const {
    Vec3 point = Vec3::Zero();
    for (std::size_t i = 0; i < amplitudes_.size(); ++i) {
      const std::size_t harmonic = i / 2 + 1;
      const double turn = 2 * std::numbers::pi * static_cast<double>(harmonic) * s;
      point += amplitudes_[i] * (i % 2 == 0 ? std::cos(turn) : std::sin(turn));
    }
    return point;
  }

 private:
  std::array<Vec3, 6> amplitudes_;
};

}  // namespace tandem::haptics
