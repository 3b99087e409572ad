// Is this coupling stable on this device in this hand, and what to change? The exact loop (sampled_loop.hpp) of each
// direction in every hand.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/coupling/sampled_loop.hpp"

namespace tandem::haptics {

/// A hand that check_coupling() tries.
struct CheckedHand {
  std::string_view name;
  std::string_view source;
  double mass_kg = 0;
  double damping_n_s_per_m = 0;
  double stiffness_n_per_m = 0;
  double inertia_kg_m2 = 0;
  double damping_n_m_s_per_rad = 0;
  double stiffness_n_m_per_rad = 0;
};
/// Nobody first.
std::span<const CheckedHand> checked_hands() noexcept;

/// The physical side of the loop: from a device profile.
struct LoopDevice {
  double mass_kg = 0.1;  ///< 0: that of the hand is of both; the device is then never alone, and its damping not known
  double damping_n_s_per_m = 0;
  bool is_verified = true;  ///< mass and damping; a finding that rests on others says so
  bool has_torque = false;
  double inertia_kg_m2 = 0;  ///< 0: alike
  double damping_n_m_s_per_rad = 0;
  bool is_rotation_verified = true;
  double period_s = 0.001;
  int velocity_window = 1;             ///< periods over which the handle's velocity is taken
  int rotational_velocity_window = 1;  ///< the steps of the angle are others
  int delay_periods = 0;
  /// A handle that moves and pushes in other than the world's metres and newtons (WorkspaceMapping): N/m at the device
  /// for each N/m in the world, and N·m/rad alike.
  double coupling_scale = 1;
  double rotational_coupling_scale = 1;
};

/// One of the loops that are checked.
struct CheckedLoop {
  bool is_rotation = false;
  std::string_view hand;
  bool is_touching = false;  ///< the tool is in stiff contact
  LoopModel model;
  double spectral_radius = 0;
};
/// Translation, then rotation where there is one, in every hand, tool in the air and in stiff contact.
/// In      slope_factor  the law's steepest slope as a multiple of its stiffness: steepest_slope_factor() in laws.hpp
std::vector<CheckedLoop> checked_loops(const CouplingParameters& parameters, double tool_mass_kg,
                                       double tool_inertia_kg_m2, const LoopDevice& device, double slope_factor = 1);

enum class StabilityVerdict : std::uint8_t { kGood, kNotPassive, kUnstable };

/// One finding, ready to be shown.
struct StabilityFinding {
  StabilityVerdict verdict = StabilityVerdict::kGood;
  bool is_rotation = false;
  std::string parameter;      ///< "coupling.stiffness_n_per_m": the one to change
  double value = 0;           ///< as the scene has it
  double rendered_value = 0;  ///< what this device is given of it, and what was checked
  double remedy = 0;          ///< a value that would do; NaN: none was found
  /// The coupling's damping that must go with `remedy`, a stiffness, where that alone does not do; else NaN.
  double remedy_damping = std::numeric_limits<double>::quiet_NaN();
  double spectral_radius = 0;  ///< the largest of the loops
  std::string text;            ///< one line: what, why, and what would do
};

/// Refuses (kUnstable) when any checked loop's spectral radius is ≥ 1: remedy is the largest stable stiffness; when
/// less than 2 % of it would be left, the nearest stable damping; when there is none, a pair. Warns (kNotPassive) when
/// the device's own damping is below k T (½ + d) + |b|, d periods of delay: then some hand exists that can take energy
/// from the coupling.
///
/// Source  Colgate, Schenkel, "Passivity of a class of sampled-data systems: application to haptic interfaces",
///         J. Robotic Systems 14(1), 1997: b > T/2 · max_ω Re{(1 − e^(−jωT)) H(e^(jωT))} / (1 − cos ωT), which for a
///         spring and backward difference is K T/2 + |B|. With H = K z^(−d) + B (1 − z^(−n)) z^(−d) / (n T) the spring
///         gives sin((d + ½) ωT) / sin(½ ωT) ≤ 2 d + 1 times K T/2, and the damper, however long its window, ≤ |B|.
///         That is of a tool held fast; one lighter than about k T² that gives way can need more, so the same condition
///         is also evaluated with the tool of the loop, at 256 frequencies
/// In      asked  what the scene asks for, where the device is given less: both are named; null: the same
/// Out     empty: stable and passive. At most one finding each for translation and rotation
/// Cost    1 to 50 ms, by the velocity window and the search for a remedy; is_stable_coupling() has the verdict sooner
std::vector<StabilityFinding> check_coupling(const CouplingParameters& parameters, double tool_mass_kg,
                                             double tool_inertia_kg_m2, const LoopDevice& device,
                                             double slope_factor = 1, const CouplingParameters* asked = nullptr);

/// False exactly where check_coupling() finds kUnstable; looks for no remedy.
///
/// Cost    one spectral_radius() for each checked loop, up to the first unstable one
bool is_stable_coupling(const CouplingParameters& parameters, double tool_mass_kg, double tool_inertia_kg_m2,
                        const LoopDevice& device, double slope_factor = 1);

}  // namespace tandem::haptics
