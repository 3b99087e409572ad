// Force of an effect on a tool in each step.
#pragma once

#include "common/physics/effects/effect_settings.hpp"

namespace tandem::physics {

/// State of a tool relative to the owner O of an effect at the start of a step, in O's axes.
struct EffectInput {
  double time_s = 0;  ///< since the scene started
  double step_s = 1e-3;
  Vec3 p_OT = Vec3::Zero();
  Twist V_OT;                    ///< velocity of the tool's origin relative to the owner's point there
  double mass_kg = 0.05;         ///< effective mass of a force between tool and owner; the least of all directions
  double inertia_kg_m2 = 1e-5;   ///< effective inertia of a torque, likewise
  double normal_force_n = 0;     ///< force of the tool on the owner in the last step
  Vec3 normal_O = Vec3::Zero();  ///< unit, out of the owner; zero: no contact
  bool is_massless = false;      ///< after each step the tool is in equilibrium; mass_kg is then k h²
};

/// State of an effect for one tool.
struct EffectMemory {
  bool is_inside = false;  ///< the effect reached the tool in the last step
  double inside_since_s = 0;
  Vec3 anchor_E = Vec3::Zero();  ///< anchor of a sticking tool
  double stiffness_n_per_m = 0;  ///< stiffness of its spring
};

/// One effect of a scene.
///
/// Model   see README.md; E is the effect's frame, p, v are position and velocity of the tool's origin. The strength w
///         is 1 inside the region and falls to 0 over fade_m outside of it (once continuously differentiable). With
///         `in_contact` it also rises with the normal force up to full_contact_n. Force and torque are clamped last,
///         with their directions kept. The force acts at the tool's origin, so its work is that of the origin.
///         Sampling: the force is held for a step. A force that depends on velocity is limited to the one that stops
///         the tool within the step. A force that depends on position is evaluated half a step ahead (a whole one for
///         stick-slip) and is never stiffer than m/(2h²). A massless tool is in equilibrium of its spring k and the
///         force of the previous step, x ← x_H + f/k. Its force is not evaluated ahead, and m = k h² keeps each
///         iteration below half of the one before. Energy statements then hold for any mass; at rest forces are exact.
/// Source  sampled springs: Colgate, Schenkel, "Passivity of a class of sampled-data systems", 1997 (b ≥ kT/2); the
///         rest our derivation
/// Thread  one at a time: the room's; no allocation, no throw
class Effect {
 public:
  /// Fails   std::invalid_argument that names the field, its value and the allowed values
  explicit Effect(const EffectSettings& settings);

  const EffectSettings& settings() const { return settings_; }

  /// Returns the wrench on the tool about its origin for the coming step, in O's axes. The owner gets the opposite.
  /// Fails   zero, and `memory` is cleared, for an input that is not finite
  Wrench wrench_on_tool_O(const EffectInput& input, EffectMemory& memory) const noexcept;

  bool is_viscous() const { return std::holds_alternative<Viscosity>(settings_.model); }
  /// Returns the local damping of a fluid, unbounded. It is for solvers that use the velocity at the end of the step,
  /// as a massless tool requires. Zero for other kinds of effects, and for an input that is not finite.
  Viscosity damping(const EffectInput& input) const noexcept;

 private:
  double strength(const Vec3& p_E, double normal_force_n) const noexcept;

  EffectSettings settings_;
  Pose X_EO_;
};

}  // namespace tandem::physics
