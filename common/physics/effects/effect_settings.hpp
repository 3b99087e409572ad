// Settings of an effect in a scene: kind of force, region and strength, with their check. The ranges of the numbers in
// scene files are in proto/scene_ranges.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "common/base/spatial.hpp"

namespace tandem::physics {

/// Viscous fluid: damps translation and rotation. The models of all kinds are in README.md.
struct Viscosity {
  double damping_n_s_per_m = 2;      ///< b
  double damping_n_m_s_per_rad = 0;  ///< damping of rotation
};

/// A uniform force, such as wind or a slope.
struct ConstantField {
  Vec3 force_n = Vec3::Zero();  ///< in the effect's axes; not zero
};

/// Pulls towards a point, a line, a plate or a block, most strongly at 1/√5 of its range.
struct Magnet {
  double peak_force_n = 1;          ///< more than 0
  double range_m = 0.03;            ///< distance from the core beyond which there is no force
  Vec3 core_size_m = Vec3::Zero();  ///< full edges of the core block; 0 0 0: a point
};

/// Vibrates continuously, or rings once on each entry.
struct Vibration {
  double frequency_hz = 100;
  double amplitude_n = 0.5;
  double decay_s = 0;              ///< time constant of the ringing; 0: continuous
  Vec3 direction = Vec3::UnitZ();  ///< in the effect's axes; any length except 0
};

/// Bumps that a tool feels while sliding: waves of the surface along the effect's x and y.
struct Texture {
  double height_m = 1e-4;    ///< amplitude of the waves along one axis; more than 0
  double period_x_m = 2e-3;  ///< more than 0
  double period_y_m = 0;     ///< 0: no waves along y, but grooves
};

/// Sticks like a spring, breaks away, and sticks again.
struct StickSlip {
  double stiffness_n_per_m = 500;  ///< more than 0
  double breakaway_force_n = 1;    ///< largest holding force; more than 0
  double slip_force_n = 0.4;       ///< force left after breaking away; 0 up to breakaway_force_n
};

using EffectModel = std::variant<Viscosity, ConstantField, Magnet, Vibration, Texture, StickSlip>;
/// Name of an effect as in scene files.
std::string_view effect_name(const EffectModel& model) noexcept;
/// All names, for messages: "viscosity, constant_field, …".
std::string listed_effect_names();

/// Box centred on the effect's origin.
struct BoxRegion {
  Vec3 size_m = Vec3::Constant(0.1);  ///< full edges, more than 0
};
struct SphereRegion {
  double radius_m = 0.05;  ///< more than 0
};
/// Region of an effect; std::monostate: everywhere.
using EffectRegion = std::variant<std::monostate, BoxRegion, SphereRegion>;

/// Settings of one effect. O: frame of the owner, a body or the world. E: frame of the effect.
struct EffectSettings {
  std::optional<std::size_t> owner;  ///< index of the owning body; none: the world
  Pose X_OE;
  EffectRegion region;          ///< region of full strength
  double fade_m = 0.005;        ///< distance outside the region over which the strength falls to 0
  bool in_contact = false;      ///< acts only while the tool presses on the owner
  double full_contact_n = 0.2;  ///< normal force of full strength; below it the effect is weaker
  double force_limit_n = 5;
  double torque_limit_n_m = 0.1;
  EffectModel model;
};

/// Checks `settings` for values that the arithmetic cannot handle, and for contradictions.
///
/// Out     the first problem, as in "magnet.range_m is 0; it must be more than 0 and finite", with the field's name in
///         scene files; empty if there is none
std::string find_problem(const EffectSettings& settings);

}  // namespace tandem::physics
