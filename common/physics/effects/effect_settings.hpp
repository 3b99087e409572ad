// Settings of an effect in a scene (kind of force, region, strength) and their check. proto/scene_ranges has the
// allowed ranges of numbers in scene files.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "common/base/spatial.hpp"

namespace tandem::physics {

/// Viscous fluid: damps translation and rotation. README.md has the models of all kinds.
struct Viscosity {
  double damping_n_s_per_m = 2;      ///< b
  double damping_n_m_s_per_rad = 0;  ///< rotational damping
};

/// A uniform force, such as that of wind, or of gravity on a slope.
struct ConstantField {
  Vec3 force_n = Vec3::Zero();  ///< force in the effect's axes; not zero
};

/// Attracts the tool to a point, a line, a plate or a block. The force is largest at 1/√5 of the range.
struct Magnet {
  double peak_force_n = 1;          ///< must be above 0
  double range_m = 0.03;            ///< distance from the core at which the force becomes zero
  Vec3 core_size_m = Vec3::Zero();  ///< full edge lengths of the core block; 0 0 0 for a point
};

/// Vibration. It is continuous, or it starts anew and decays whenever the tool enters the region.
struct Vibration {
  double frequency_hz = 100;
  double amplitude_n = 0.5;
  double decay_s = 0;              ///< time constant of the decay; 0: continuous vibration
  Vec3 direction = Vec3::UnitZ();  ///< direction in the effect's axes; any length except 0
};

/// Bumps that a tool feels while it slides, like a surface with sinusoidal waves along the effect's x and y axes.
struct Texture {
  double height_m = 1e-4;    ///< amplitude of the waves along one axis; must be above 0
  double period_x_m = 2e-3;  ///< wavelength along x; must be above 0
  double period_y_m = 0;     ///< wavelength along y; 0: no waves along y, so the surface has grooves
};

/// Friction that sticks to an anchor like a spring, breaks away, and sticks again.
struct StickSlip {
  double stiffness_n_per_m = 500;  ///< must be above 0
  double breakaway_force_n = 1;    ///< largest holding force; must be above 0
  double slip_force_n = 0.4;       ///< force that remains after breaking away; 0 to breakaway_force_n
};

using EffectModel = std::variant<Viscosity, ConstantField, Magnet, Vibration, Texture, StickSlip>;
/// Returns the name of an effect in scene files.
std::string_view effect_name(const EffectModel& model) noexcept;
/// Returns all names for messages: "viscosity, constant_field, …".
std::string listed_effect_names();

/// Box whose centre is the effect's origin.
struct BoxRegion {
  Vec3 size_m = Vec3::Constant(0.1);  ///< full edge lengths; must be above 0
};
struct SphereRegion {
  double radius_m = 0.05;  ///< must be above 0
};
/// Region of an effect; std::monostate stands for all of space.
using EffectRegion = std::variant<std::monostate, BoxRegion, SphereRegion>;

/// Settings of one effect. O is the frame of the owner, which is a body or the world; E is the frame of the effect.
struct EffectSettings {
  std::optional<std::size_t> owner;  ///< index of the body that owns the effect; empty: the world owns it
  Pose X_OE;
  EffectRegion region;          ///< region in which the effect has its full strength
  double fade_m = 0.005;        ///< distance outside the region over which the strength falls to 0
  bool in_contact = false;      ///< whether the effect acts only while the tool touches the owner
  double full_contact_n = 0.2;  ///< normal force at which the strength is full; with less force it is smaller
  double force_limit_n = 5;
  double torque_limit_n_m = 0.1;
  EffectModel model;
};

/// Checks `settings` for contradictions, and for values with which the model cannot be computed.
///
/// Out     the first problem, such as "magnet.range_m is 0; it must be more than 0 and finite", with the name of the
///         field in scene files; empty if there is no problem
std::string find_problem(const EffectSettings& settings);

}  // namespace tandem::physics
