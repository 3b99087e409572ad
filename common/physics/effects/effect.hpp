// The force of an effect on a tool, step by step.
#pragma once

#include "common/physics/effects/effect_settings.hpp"

namespace tandem::physics {

/// How a tool is to the owner O of an effect at the start of a step; everything in O's axes.
struct EffectInput {
  double time_s = 0;  ///< since the scene started
  double step_s = 1e-3;
  Vec3 p_OT = Vec3::Zero();
  Twist V_OT;                    ///< of the tool's origin past the owner's point that is there
  double mass_kg = 0.05;         ///< that a force between tool and owner has to move; the least of all directions
  double inertia_kg_m2 = 1e-5;   ///< alike, of a torque
  double normal_force_n = 0;     ///< with which the tool pressed on the owner in the last step
  Vec3 normal_O = Vec3::Zero();  ///< unit, out of the owner; zero: no contact
  bool is_massless = false;      ///< after each step the tool is where all balances; mass_kg is then k h²
};

/// What an effect remembers of one tool.
struct EffectMemory {
  bool is_inside = false;  ///< the effect reached the tool in the last step
  double inside_since_s = 0;
  Vec3 anchor_E = Vec3::Zero();  ///< where the tool sticks
  double stiffness_n_per_m = 0;  ///< of what it sticks with
};

/// One effect of a scene.
///
/// Model   see README.md; E is the effect's frame, p, v the tool's origin and its velocity. The strength w is 1
///         inside the region and falls to 0 over fade_m outside of it (once continuously differentiable), and rises
///         with the normal force up to full_contact_n for what asks for contact. Force and torque are bounded at last,
///         their directions kept. The force acts at the tool's origin, so that its work is that of the origin.
///         Sampling: the force is held for a step, so what depends on velocity is bounded by what stops the tool in it,
///         and what depends on place is taken ahead by half a step (a whole one for stick-slip) and never stiffer
///         than m/(2h²). A massless tool is where its spring k and the force of the step before balance, x ← x_H + f/k:
///         nothing is taken ahead, for that would be ahead of itself, and m = k h² keeps each round below half of the
///         one before. What is said of energy there then holds for any mass; at rest forces are exact.
/// Source  sampled springs: Colgate, Schenkel, "Passivity of a class of sampled-data systems", 1997 (b ≥ kT/2);
///         the rest our derivation
/// Thread  one at a time: the room's; no allocation, no throw
class Effect {
 public:
  /// Fails   std::invalid_argument that names the field, what it is and what it must be
  explicit Effect(const EffectSettings& settings);

  const EffectSettings& settings() const { return settings_; }

  /// On the tool about its origin, in O's axes; the owner gets the opposite. For the coming step.
  /// Fails   zero, and `memory` forgotten, for an input that is not finite
  Wrench wrench_on_tool_O(const EffectInput& input, EffectMemory& memory) const noexcept;

  bool is_viscous() const { return std::holds_alternative<Viscosity>(settings_.model); }
  /// The fluid as thick as it is there, unbounded: for who solves for the velocity at the end of the step, as a
  /// massless tool needs. Zero of other kinds, and for an input that is not finite.
  Viscosity damping(const EffectInput& input) const noexcept;

 private:
  double strength(const Vec3& p_E, double normal_force_n) const noexcept;

  EffectSettings settings_;
  Pose X_EO_;
};

}  // namespace tandem::physics
