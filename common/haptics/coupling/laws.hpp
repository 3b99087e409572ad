// Every coupling law of the project: its force, its source, and whether it can create energy. README.md has the table.
// A law is an elastic curve and an entry of the catalog, both in laws.cpp.
//
// All laws but direct add a damper, b (v_H − v_T), and saturate the whole force at F_max (saturation.hpp); rotation
// alike. "Passive": the elastic part is the gradient of a convex potential and the damper opposes motion, so no energy
// is created in continuous time. For the sampled case see haptics/passivity. "Active": the law can create energy; a
// test shows how much.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

struct CouplingChannel;
struct RadialStiffness;

/// Properties of a law that a user should compare before choosing it.
struct CouplingLawInfo {
  std::string_view name;
  bool is_passive = false;
  ToolDynamics tool = ToolDynamics::kWithMass;
  std::string_view model;  ///< one line, letters as in CouplingParameters; rotation alike
  std::string_view source;
  std::string_view limits;  ///< weaknesses
  /// Elastic part as magnitude against displacement ≥ 0; null: no coupling. `is_pushing`: the handle moves away from
  /// the tool or stands still, d·v_WH ≥ 0 (θ·ω_WH ≥ 0).
  RadialStiffness (*elastic)(const CouplingChannel& channel, double displacement, bool is_pushing) noexcept = nullptr;
  /// Largest slope of the elastic part as a multiple of the stiffness.
  double (*steepest)(const CouplingParameters& parameters) noexcept = nullptr;

  std::unique_ptr<CouplingLaw> make(const CouplingParameters& parameters) const;
};

inline constexpr std::string_view kDefaultCouplingLaw = "stable-dynamic";
inline constexpr std::string_view kAdaptiveLaw = "adaptive";  ///< the law that needs a fit

/// All laws, the default first.
std::span<const CouplingLawInfo> coupling_laws() noexcept;
/// Returns null for an unknown name; "" means the default.
const CouplingLawInfo* find_coupling_law(std::string_view name) noexcept;
/// Returns null for an unknown name; "" means the default.
std::unique_ptr<CouplingLaw> make_coupling_law(std::string_view name, const CouplingParameters& parameters);
/// Returns "stable-dynamic, spring-damper, …" for messages.
std::string listed_coupling_law_names();

/// Returns whether one law may replace the other under a hand: both tools must have mass. A change to another kind of
/// tool would move the tool by a step, and the hand with it.
constexpr bool are_exchangeable(const CouplingLawInfo& a, const CouplingLawInfo& b) noexcept {
  return a.tool == ToolDynamics::kWithMass && b.tool == ToolDynamics::kWithMass;
}
/// Returns why a running scene with law `of_scene` cannot change to `wanted`; empty when it can.
/// In      has_fit  the scene has a fit for the adaptive law
std::string law_change_problem(const CouplingLawInfo& of_scene, const CouplingLawInfo& wanted, bool has_fit);

/// Returns the largest slope ∂f/∂d of a law's elastic part as a multiple of its stiffness; 0 without an elastic part.
///
/// Fails   1 for an unknown law
double steepest_slope_factor(std::string_view law, const CouplingParameters& parameters) noexcept;

}  // namespace tandem::haptics
