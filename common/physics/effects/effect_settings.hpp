// What a scene's author says of an effect: which force, where, how strong; and what is wrong with it. What each number
// may be in a scene is in proto/scene_ranges.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "common/base/spatial.hpp"

namespace tandem::physics {

/// Thick fluid: slows the tool, and its turning. For the models behind these see README.md.
struct Viscosity {
  double damping_n_s_per_m = 2;      ///< b
  double damping_n_m_s_per_rad = 0;  ///< of turning
};

/// The same force everywhere: wind, a slope.
struct ConstantField {
  Vec3 force_n = Vec3::Zero();  ///< in the effect's axes; not zero
};

/// Pulls towards a point, a line, a plate or a block, most strongly at 1/√5 of its range.
struct Magnet {
  double peak_force_n = 1;          ///< more than 0
  double range_m = 0.03;            ///< from the core; farther away it does not pull
  Vec3 core_size_m = Vec3::Zero();  ///< full edges of the block that it pulls to; 0 0 0: a point
};

/// Shakes, or rings once each time it is entered.
struct Vibration {
  double frequency_hz = 100;
  double amplitude_n = 0.5;
  double decay_s = 0;              ///< time constant of the ringing; 0: goes on
  Vec3 direction = Vec3::UnitZ();  ///< in the effect's axes, of any length but 0
};

/// Bumps that a tool feels as it slides: waves of the surface along the effect's x and y.
struct Texture {
  double height_m = 1e-4;    ///< from mean to crest, of the waves of one axis; more than 0
  double period_x_m = 2e-3;  ///< more than 0
  double period_y_m = 0;     ///< 0: none, grooves along y
};

/// Sticks like a spring, lets go at once, and sticks again.
struct StickSlip {
  double stiffness_n_per_m = 500;  ///< more than 0
  double breakaway_force_n = 1;    ///< that it holds at most; more than 0
  double slip_force_n = 0.4;       ///< what is left of it after letting go; 0 up to breakaway_force_n
};

using EffectModel = std::variant<Viscosity, ConstantField, Magnet, Vibration, Texture, StickSlip>;
/// As in scene files.
std::string_view effect_name(const EffectModel& model) noexcept;
/// "viscosity, constant_field, …": for messages.
std::string listed_effect_names();

/// Centred on the effect's origin.
struct BoxRegion {
  Vec3 size_m = Vec3::Constant(0.1);  ///< full edges, more than 0
};
struct SphereRegion {
  double radius_m = 0.05;  ///< more than 0
};
/// None: everywhere.
using EffectRegion = std::variant<std::monostate, BoxRegion, SphereRegion>;

/// O: the owner, a body or the world. E: the effect.
struct EffectSettings {
  std::optional<std::size_t> owner;  ///< index of the body that it belongs to; none: it is the world's
  Pose X_OE;
  EffectRegion region;          ///< full strength inside
  double fade_m = 0.005;        ///< from full strength to none outside the region
  bool in_contact = false;      ///< only while the tool presses on the owner
  double full_contact_n = 0.2;  ///< pressing with less is felt less
  double force_limit_n = 5;
  double torque_limit_n_m = 0.1;
  EffectModel model;
};

/// What arithmetic with `settings` could not bear, and what they must be together.
///
/// Out     the first thing wrong, "magnet.range_m is 0; it must be more than 0 and finite", its field named as in scene
///         files; empty when they can be used
std::string find_problem(const EffectSettings& settings);

}  // namespace tandem::physics
