// Effects of all kinds for tests, and a tool that is moved by an effect in the same way as in the server.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "common/physics/effects/effect.hpp"
#include "tests/support/markdown_table.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::physics {

inline std::array<EffectModel, 6> every_model() {
  return {Viscosity{5, 0.01}, ConstantField{{1, 2, -0.5}}, Magnet{2, 0.03, {0.01, 0, 0}},
          Vibration{},        Texture{2e-4, 4e-3, 3e-3},   StickSlip{500, 1, 0.4}};
}

inline EffectSettings effect_with(const EffectModel& model) {
  EffectSettings settings;
  settings.model = model;
  return settings;
}

/// Returns settings of an effect whose region is a ball with a radius of 2 cm. A magnet has no region but its own
/// range.
inline EffectSettings ball_with(const EffectModel& model) {
  EffectSettings settings = effect_with(model);
  if (!std::holds_alternative<Magnet>(model)) settings.region = SphereRegion{0.02};
  return settings;
}

inline std::string name_of(const EffectModel& model) {
  return std::string(effect_name(model));
}

/// Returns the rows of the README's catalog of effects, in the order of EffectModel.
inline std::vector<test::TableRow> rows_of_readme() {
  return test::table_under(test::source_path("common/physics/effects/README.md").string(), "## Catalog");
}

inline Vec3 random_vec3(Random& random, double magnitude) {
  return {random.uniform(-magnitude, magnitude), random.uniform(-magnitude, magnitude),
          random.uniform(-magnitude, magnitude)};
}

inline double magnet_potential_j(const Magnet& magnet, const Vec3& p) {
  // Depth U₀ of the potential. It follows from the peak of the force 6 U₀/R s (1 − s²)², which is at s = 1/√5. R is the
  // range, and s the distance from the core divided by R.
  const double depth_j = magnet.peak_force_n * magnet.range_m / 6 * 25 * std::sqrt(5.0) / 16;
  const Vec3 half = magnet.core_size_m / 2;
  const double s2 = ((p - p.cwiseMax(-half).cwiseMin(half)) / magnet.range_m).squaredNorm();
  return s2 < 1 ? -depth_j * std::pow(1 - s2, 3) : 0;
}

/// A free ball. Each step first applies the force of the effect explicitly, then the hand's spring and damper
/// implicitly.
struct SteppedTool {
  double mass_kg = 0.05;
  double step_s = 1e-3;
  Vec3 p = Vec3::Zero();
  Vec3 v = Vec3::Zero();
  double time_s = 0;
  double normal_force_n = 1;
  EffectMemory memory;

  EffectInput input() const {
    return {time_s, step_s, p, {v, Vec3::Zero()}, mass_kg, 1e-5, normal_force_n, Vec3::UnitZ()};
  }

  /// Runs one step without a hand. Returns the force on the tool.
  Vec3 step(const Effect& effect) { return step_to(effect, Vec3::Zero(), 0, 0); }

  /// Runs one step with a spring and damper that pull to `target`. Returns the force of the effect.
  Vec3 step_to(const Effect& effect, const Vec3& target, double stiffness, double damping) {
    const Vec3 f = effect.wrench_on_tool_O(input(), memory).f;
    const double h = step_s;
    const Vec3 freely = v + h / mass_kg * f;
    // The implicit velocity v' satisfies m (v' − freely) = h (k (target − p − h v') − b v').
    v = (mass_kg * freely + h * stiffness * (target - p)) / (mass_kg + h * damping + h * h * stiffness);
    p += h * v;
    time_s += h;
    return f;
  }

  double kinetic_j() const { return 0.5 * mass_kg * v.squaredNorm(); }
};

}  // namespace tandem::physics
