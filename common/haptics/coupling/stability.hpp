// Is this coupling stable on this device in this hand? The exact discrete loop of one direction, and what to change.
//
//   hand (m, b, k) ─ device (m, b) ─ encoder ─ velocity window ─ delay ─ coupling (k, b) ─ tool (m) ─ contact (k)
//                        ▲ force held for a period ◀──────────────────────┘
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

/// One translational direction; for a rotational one read inertia, N·m/rad and N·m·s/rad.
struct LoopModel {
  double period_s = 0.001;
  double stiffness = 300;        ///< of the coupling: the steepest slope of its law [N/m]
  double damping = 3;            ///< of the coupling [N·s/m]
  double tool_mass = 0.1;        ///< [kg]; 0: massless
  double device_mass = 0.1;      ///< [kg]
  double device_damping = 0.0;   ///< of the mechanism [N·s/m]
  double hand_mass = 0.3;        ///< [kg]; all three 0: nobody holds it
  double hand_stiffness = 200;   ///< [N/m]
  double hand_damping = 5.8;     ///< [N·s/m]
  double contact_stiffness = 0;  ///< what the tool touches [N/m]; 0: nothing
  int velocity_window = 1;       ///< samples over which the handle's velocity is taken
  int delay_periods = 0;         ///< from sample to force, beyond the one that holding takes
};

/// Largest magnitude of an eigenvalue of the loop's transition over one period; below 1 it is stable.
///
/// Model   hand and device together are one mass, integrated exactly under a held force (matrix exponential). Each
///         period: handle x_{k−d}, its velocity (x_{k−d} − x_{k−d−n}) / (n T); the tool's end-of-step state from
///         coupling and contact by implicit Euler, as the contact solver steps it; the hand gets the opposite of the
///         force that the tool got, until the next period.
///         What nothing in the loop feels is left out: the position of a device that nobody holds with a tool that
///         touches nothing, and, without friction, their common glide. Both are eigenvalues 1 and harm nobody.
/// Source  our derivation
/// Out     0 without stiffness and damping: there is no loop
/// Fails   infinity for a model that is not finite, has a negative entry or no mass, or looks back more than 64 periods
/// Cost    cubic in window + delay; 5 µs at window 1 without delay, 1 ms at 20 (thread any but haptic: allocates)
double spectral_radius(const LoopModel& model);

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
