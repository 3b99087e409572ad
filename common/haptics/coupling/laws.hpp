// Every coupling law of the project: what each does, where it is from, and whether it can create energy. README.md has
// them as a table. A law is an elastic curve and an entry of the catalog, both in laws.cpp.
//
// All but direct add a damper, b (v_H − v_T), and saturate the whole force at F_max (saturation.hpp); rotation alike.
// "Passive": the elastic part is the gradient of a convex potential and the damper opposes motion, so in continuous
// time nothing is created; sampled, see haptics/passivity. "Active": it can create energy, and a test shows how much.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

struct CouplingChannel;
struct RadialStiffness;

/// What a user should know of a law before choosing it.
struct CouplingLawInfo {
  std::string_view name;
  bool is_passive = false;
  ToolDynamics tool = ToolDynamics::kWithMass;
  std::string_view model;  ///< one line, letters as in CouplingParameters; rotation alike
  std::string_view source;
  std::string_view limits;  ///< what it is not good at
  /// The elastic part as magnitude against displacement ≥ 0; null: there is no coupling. `is_pushing`: the handle moves
  /// away from the tool or stands, d·v_WH ≥ 0 (θ·ω_WH ≥ 0).
  RadialStiffness (*elastic)(const CouplingChannel& channel, double displacement, bool is_pushing) noexcept = nullptr;
  /// Its largest slope as a multiple of the stiffness.
  double (*steepest)(const CouplingParameters& parameters) noexcept = nullptr;

  std::unique_ptr<CouplingLaw> make(const CouplingParameters& parameters) const;
};

inline constexpr std::string_view kDefaultCouplingLaw = "stable-dynamic";
inline constexpr std::string_view kAdaptiveLaw = "adaptive";  ///< the one that needs a fit

/// All laws, the default first.
std::span<const CouplingLawInfo> coupling_laws() noexcept;
/// Null when there is none of that name; "" means the default.
const CouplingLawInfo* find_coupling_law(std::string_view name) noexcept;
/// Null when there is none of that name; "" means the default.
std::unique_ptr<CouplingLaw> make_coupling_law(std::string_view name, const CouplingParameters& parameters);
/// "stable-dynamic, spring-damper, …": for messages.
std::string listed_coupling_law_names();

/// One may take the other's place under a hand: both have a tool with mass. The tool of another kind would be moved by a
/// step, and the hand with it.
constexpr bool are_exchangeable(const CouplingLawInfo& a, const CouplingLawInfo& b) noexcept {
  return a.tool == ToolDynamics::kWithMass && b.tool == ToolDynamics::kWithMass;
}
/// Why a running scene of law `of_scene` cannot have `wanted`; empty when it can.
/// In      has_fit  the scene has that of the adaptive law
std::string law_change_problem(const CouplingLawInfo& of_scene, const CouplingLawInfo& wanted, bool has_fit);

/// Largest slope ∂f/∂d of a law's elastic part, as a multiple of its stiffness parameter; 0 for a law without one.
///
/// Fails   1 for an unknown law
double steepest_slope_factor(std::string_view law, const CouplingParameters& parameters) noexcept;

}  // namespace tandem::haptics
