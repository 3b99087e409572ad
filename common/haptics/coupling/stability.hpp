// Stability check of a coupling on a device, with a remedy. Evaluates the exact loop (sampled_loop.hpp) of each
// direction for every assumed hand.
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

/// A hand for which check_coupling() evaluates the loop.
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
/// Returns all checked hands; the first is "nobody".
std::span<const CheckedHand> checked_hands() noexcept;

/// Physical side of the loop, from a device profile.
struct LoopDevice {
  /// 0: the hand's mass includes the device's. The device alone is then not checked, and its damping is unknown.
  double mass_kg = 0.1;
  double damping_n_s_per_m = 0;
  bool is_verified = true;  ///< whether mass and damping are verified; a finding that rests on unverified ones says so
  bool has_torque = false;
  double inertia_kg_m2 = 0;  ///< 0: as for mass_kg
  double damping_n_m_s_per_rad = 0;
  bool is_rotation_verified = true;
  double period_s = 0.001;
  int velocity_window = 1;             ///< periods over which the handle's velocity is taken
  int rotational_velocity_window = 1;  ///< for rotation, whose resolution differs
  int delay_periods = 0;
  /// Scale of stiffness for a handle that moves and pushes in other units than the world's metres and newtons
  /// (WorkspaceMapping): N/m at the device for each N/m in the world; N·m/rad alike.
  double coupling_scale = 1;
  double rotational_coupling_scale = 1;
};

/// One checked loop.
struct CheckedLoop {
  bool is_rotation = false;
  std::string_view hand;
  bool is_touching = false;  ///< the tool is in stiff contact
  LoopModel model;
  double spectral_radius = 0;
};
/// Returns the loops of translation, then of rotation if the device has torque; in every hand, with the tool in the air
/// and in stiff contact.
/// In      slope_factor  the law's steepest slope as a multiple of its stiffness: steepest_slope_factor() in laws.hpp
std::vector<CheckedLoop> checked_loops(const CouplingParameters& parameters, double tool_mass_kg,
                                       double tool_inertia_kg_m2, const LoopDevice& device, double slope_factor = 1);

enum class StabilityVerdict : std::uint8_t { kGood, kNotPassive, kUnstable };

/// One finding, ready to be shown.
struct StabilityFinding {
  StabilityVerdict verdict = StabilityVerdict::kGood;
  bool is_rotation = false;
  std::string parameter;      ///< parameter to change, such as "coupling.stiffness_n_per_m"
  double value = 0;           ///< value in the scene
  double rendered_value = 0;  ///< value rendered on this device, which was checked
  double remedy = 0;          ///< value that passes the check; NaN: none was found
  /// Damping of the coupling that is needed together with the stiffness `remedy` where that alone does not pass; else
  /// NaN.
  double remedy_damping = std::numeric_limits<double>::quiet_NaN();
  double spectral_radius = 0;  ///< largest of all loops
  std::string text;            ///< one line: the problem, its reason, and the remedy
};

/// Checks a coupling on a device. Refuses it (kUnstable) when any checked loop's spectral radius is ≥ 1. The remedy is
/// the largest stable stiffness; when that is below 2 % of the present one, the nearest stable damping; when there is
/// none, a pair. Warns (kNotPassive) when the device's own damping is below k T (½ + d) + |b|, d periods of delay: then
/// some hand can extract energy from the coupling.
///
/// Source  Colgate, Schenkel, "Passivity of a class of sampled-data systems: application to haptic interfaces", J.
///         Robotic Systems 14(1), 1997: b > T/2 · max_ω Re{(1 − e^(−jωT)) H(e^(jωT))} / (1 − cos ωT), which for a
///         spring and backward difference is K T/2 + |B|. With H = K z^(−d) + B (1 − z^(−n)) z^(−d) / (n T) the spring
///         gives sin((d + ½) ωT) / sin(½ ωT) ≤ 2 d + 1 times K T/2, and the damper ≤ |B| for any window. This holds for
///         a tool that is held fast. A movable tool lighter than about k T² can need more, so the condition is also
///         evaluated with the tool of the loop, at 256 frequencies
/// In      requested  coupling in the scene where the device renders less: the text names both; null: the same
/// Out     empty: stable and passive. At most one finding each for translation and rotation
/// Cost    1 to 50 ms, depending on the velocity window and the search for a remedy; is_stable_coupling() is faster
std::vector<StabilityFinding> check_coupling(const CouplingParameters& parameters, double tool_mass_kg,
                                             double tool_inertia_kg_m2, const LoopDevice& device,
                                             double slope_factor = 1, const CouplingParameters* requested = nullptr);

/// Returns false exactly where check_coupling() finds kUnstable; searches no remedy.
///
/// Cost    one spectral_radius() for each checked loop, up to the first unstable one
bool is_stable_coupling(const CouplingParameters& parameters, double tool_mass_kg, double tool_inertia_kg_m2,
                        const LoopDevice& device, double slope_factor = 1);

}  // namespace tandem::haptics
