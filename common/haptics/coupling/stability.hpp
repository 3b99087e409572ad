// Stability check of a coupling on a device, with a remedy for the user. For each direction and each assumed hand, it
// evaluates the exact discrete loop (sampled_loop.hpp).
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
/// Returns all assumed hands; the first, "nobody", stands for a device that is not held.
std::span<const CheckedHand> checked_hands() noexcept;

/// Properties of a device that influence the loop, from the device's profile.
struct LoopDevice {
  /// Mass of the device [kg]. 0 means that the hand's mass includes the device's mass. In this case, two checks are
  /// skipped: the loop without a hand, and the device's damping.
  double mass_kg = 0.1;
  double damping_n_s_per_m = 0;
  bool is_verified = true;  ///< whether mass and damping are verified; if not, the text of a finding says so
  bool has_torque = false;
  double inertia_kg_m2 = 0;  ///< [kg·m²]; 0 has the same meaning as for mass_kg
  double damping_n_m_s_per_rad = 0;
  bool is_rotation_verified = true;
  double period_s = 0.001;
  int velocity_window = 1;             ///< number of periods over which the handle's velocity is estimated
  int rotational_velocity_window = 1;  ///< as velocity_window, but for rotation
  int delay_periods = 0;
  /// Stiffness at the device [N/m] for a stiffness of 1 N/m in the world. It differs from 1 if the workspace scales
  /// motion or force (WorkspaceMapping). The rotational scale applies to N·m/rad.
  double coupling_scale = 1;
  double rotational_coupling_scale = 1;
};

/// One loop that was checked.
struct CheckedLoop {
  bool is_rotation = false;
  std::string_view hand;
  bool is_touching = false;  ///< whether the tool is in stiff contact
  LoopModel model;
  double spectral_radius = 0;
};
/// Returns the loops of translation, followed by those of rotation if the device has torque. There are two loops for
/// each hand: one with the tool in the air, and one with the tool in stiff contact.
/// In      slope_factor  the law's steepest slope as a multiple of its stiffness: steepest_slope_factor() in laws.hpp
std::vector<CheckedLoop> checked_loops(const CouplingParameters& parameters, double tool_mass_kg,
                                       double tool_inertia_kg_m2, const LoopDevice& device, double slope_factor = 1);

enum class StabilityVerdict : std::uint8_t { kGood, kNotPassive, kUnstable };

/// One finding of the check, with a text for the user.
struct StabilityFinding {
  StabilityVerdict verdict = StabilityVerdict::kGood;
  bool is_rotation = false;
  std::string parameter;      ///< parameter to change, such as "coupling.stiffness_n_per_m"
  double value = 0;           ///< value of the parameter in the scene
  double rendered_value = 0;  ///< value rendered on this device; this value was checked
  double remedy = 0;          ///< value with which the check passes; NaN if none was found
  /// Damping that must accompany the stiffness `remedy`, if the remedy is a pair; NaN if `remedy` alone suffices.
  double remedy_damping = std::numeric_limits<double>::quiet_NaN();
  double spectral_radius = 0;  ///< largest spectral radius of the checked loops
  std::string text;            ///< one line: the problem, its reason, and the remedy
};

/// Checks a coupling on a device. The verdict is one of two:
/// * kUnstable: the spectral radius of a checked loop is ≥ 1.
/// * kNotPassive: the device's mechanical damping is below k T (½ + d) + |b|, with stiffness k, damping b, period T and
///   d periods of delay. Some hand can then extract energy from the coupling.
/// The remedy is the first of these with which the check passes:
/// 1. the largest stiffness, if it is at least 2 % of the present stiffness
/// 2. the nearest damping (for kNotPassive: only a smaller one)
/// 3. for kUnstable: a pair of stiffness and damping; for kNotPassive: a larger damping of the device
///
/// Source  Colgate, Schenkel, "Passivity of a class of sampled-data systems: application to haptic interfaces", J.
///         Robotic Systems 14(1), 1997. The device needs the damping
///           T/2 · max_ω Re{(1 − e^(−jωT)) H(e^(jωT))} / (1 − cos ωT)
///         where H is the coupling's force per position. For a spring K and a damper B with backward difference, this
///         is K T/2 + |B|. With a delay of d periods and a velocity window of n periods,
///           H = K z^(−d) + B (1 − z^(−n)) z^(−d) / (n T).
///         The spring's term is then K T/2 · sin((d + ½) ωT) / sin(½ ωT), at most (2 d + 1) K T/2. The damper's term is
///         at most |B| for any window. Both bounds hold for a tool that is held fast. A movable tool lighter than about
///         k T² can need more damping, so the damping is also evaluated for the loop with its tool, at 256 frequencies
/// In      requested  coupling in the scene, if the device renders a weaker one; the text of the finding then names
///         both. Null if the device renders the scene's coupling
/// Out     empty if the coupling is stable and passive; otherwise at most one finding each for translation and rotation
/// Cost    1 to 50 ms, depending on the velocity window and the search for a remedy; is_stable_coupling() is faster
std::vector<StabilityFinding> check_coupling(const CouplingParameters& parameters, double tool_mass_kg,
                                             double tool_inertia_kg_m2, const LoopDevice& device,
                                             double slope_factor = 1, const CouplingParameters* requested = nullptr);

/// Returns false if and only if check_coupling() finds kUnstable. Does not search for a remedy.
///
/// Cost    one spectral_radius() per loop, up to the first unstable loop
bool is_stable_coupling(const CouplingParameters& parameters, double tool_mass_kg, double tool_inertia_kg_m2,
                        const LoopDevice& device, double slope_factor = 1);

}  // namespace tandem::haptics
