// Computes the force of an effect on a tool in each step.
#pragma once

#include "common/physics/effects/effect_settings.hpp"

namespace tandem::physics {

/// State of a tool relative to the owner O of an effect (a body or the world) at the start of a step, in the axes of O.
struct EffectInput {
  double time_s = 0;  ///< time since the scene started
  double step_s = 1e-3;
  Vec3 p_OT = Vec3::Zero();
  Twist V_OT;  ///< velocity of the tool's origin relative to the owner's point there
  /// Smallest effective mass, over all directions, for a force between tool and owner.
  double mass_kg = 0.05;
  /// Smallest effective moment of inertia, over all directions, for a torque between tool and owner.
  double inertia_kg_m2 = 1e-5;
  double normal_force_n = 0;     ///< normal force of the tool on the owner in the last step
  Vec3 normal_O = Vec3::Zero();  ///< unit vector out of the owner; zero if there is no contact
  bool is_massless = false;      ///< true: the tool moves to its equilibrium in each step; mass_kg is then k h²
};

/// State that an effect stores for one tool.
struct EffectMemory {
  bool is_inside = false;  ///< whether the effect acted on the tool in the last step
  double inside_since_s = 0;
  Vec3 anchor_E = Vec3::Zero();  ///< anchor point of a sticking tool
  double stiffness_n_per_m = 0;  ///< stiffness of the spring to the anchor
};

/// One effect of a scene.
///
/// Model   README.md has the models. E is the effect's frame. The force acts at the tool's origin, so its work is the
///         work at the origin.
///         Strength: a factor that is 1 inside the region and falls to 0 over the distance fade_m outside of it, with a
///         continuous derivative. With `in_contact` it also rises with the normal force, up to full_contact_n. Finally,
///         force and torque are clamped without a change of direction.
///         Sampling: the force is held for a step h. A velocity-dependent force is limited to the force that stops the
///         tool within the step. A position-dependent force is evaluated half a step ahead (a whole step for
///         stick-slip), and its stiffness is at most m/(2h²) for the tool's effective mass m.
///         Massless tools: the tool is in equilibrium between the spring k of its coupling and the force f of the
///         previous step: x ← x_H + f/k, with the tool's position x and the handle's position x_H. The force is not
///         evaluated ahead. With m = k h², each iteration changes x by less than half of the previous change. The
///         statements on energy therefore hold for any mass, and forces at rest are exact.
/// Source  sampled springs: Colgate, Schenkel, "Passivity of a class of sampled-data systems", 1997 (b ≥ kT/2); the
///         rest is our derivation
/// Thread  room; no allocation, no throw
class Effect {
 public:
  /// Fails   throws std::invalid_argument that names the field, its value and the allowed values
  explicit Effect(const EffectSettings& settings);

  const EffectSettings& settings() const { return settings_; }

  /// Returns the wrench on the tool about its origin for the coming step, in the axes of O. The owner receives the
  /// opposite wrench.
  /// Fails   if an input is not finite: returns zero and clears `memory`
  Wrench wrench_on_tool_O(const EffectInput& input, EffectMemory& memory) const noexcept;

  bool is_viscous() const { return std::holds_alternative<Viscosity>(settings_.model); }
  /// Returns the damping of a fluid at the tool's position, without any limit; zero for other kinds of effects and for
  /// an input that is not finite. For massless tools, the solver computes the drag itself, from the velocity at the end
  /// of the step.
  Viscosity damping(const EffectInput& input) const noexcept;

 private:
  double strength(const Vec3& p_E, double normal_force_n) const noexcept;

  EffectSettings settings_;
  Pose X_EO_;
};

}  // namespace tandem::physics
