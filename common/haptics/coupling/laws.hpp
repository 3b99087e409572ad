// All coupling laws of the project: the force of each, its source, and whether it can create energy. README.md has a
// table. A law consists of an elastic curve and an entry in the catalog, both in laws.cpp.
//
// All laws except "direct" add a damper, b (v_H − v_T), and saturate the total force at F_max (saturation.hpp).
// Rotation is treated in the same way.
// Passive laws: the elastic part is the gradient of a convex potential, and the damper opposes motion. Such a law
// creates no energy in continuous time; haptics/passivity treats the sampled case.
// Active laws: they can create energy; a test measures how much.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

struct CouplingChannel;
struct RadialStiffness;

/// Properties of a law, as shown to a user who chooses one.
struct CouplingLawInfo {
  std::string_view name;
  bool is_passive = false;
  ToolDynamics tool = ToolDynamics::kWithMass;
  std::string_view model;  ///< equation in one line, with the letters of CouplingParameters; rotation has the same form
  std::string_view source;
  std::string_view limits;  ///< weaknesses of the law
  /// Elastic curve: returns secant and slope of the force at a displacement ≥ 0; null if the law has no coupling.
  /// `is_pushing` is true if the handle rests or moves away from the tool: d·v_WH ≥ 0 (for rotation θ·ω_WH ≥ 0).
  RadialStiffness (*elastic)(const CouplingChannel& channel, double displacement, bool is_pushing) noexcept = nullptr;
  /// Largest slope of the elastic curve, as a multiple of the stiffness.
  double (*steepest)(const CouplingParameters& parameters) noexcept = nullptr;

  std::unique_ptr<CouplingLaw> make(const CouplingParameters& parameters) const;
};

inline constexpr std::string_view kDefaultCouplingLaw = "stable-dynamic";
inline constexpr std::string_view kAdaptiveLaw = "adaptive";  ///< law with coefficients from a calibrated fit

/// All laws; the first is the default.
std::span<const CouplingLawInfo> coupling_laws() noexcept;
/// Returns null for an unknown name; "" means the default.
const CouplingLawInfo* find_coupling_law(std::string_view name) noexcept;
/// Returns null for an unknown name; "" means the default.
std::unique_ptr<CouplingLaw> make_coupling_law(std::string_view name, const CouplingParameters& parameters);
/// Returns "stable-dynamic, spring-damper, …" for messages.
std::string listed_coupling_law_names();

/// Returns whether one law may replace the other while a user is coupled to the tool. Both must be made for a tool with
/// mass; otherwise the tool would jump, and the user's hand would feel a step.
constexpr bool are_exchangeable(const CouplingLawInfo& a, const CouplingLawInfo& b) noexcept {
  return a.tool == ToolDynamics::kWithMass && b.tool == ToolDynamics::kWithMass;
}
/// Returns the reason why a running scene with the law `of_scene` cannot change to `wanted`; empty if it can.
/// In      has_fit  whether the scene has a fit for the adaptive law
std::string law_change_problem(const CouplingLawInfo& of_scene, const CouplingLawInfo& wanted, bool has_fit);

/// Returns the largest slope ∂f/∂d of the elastic curve of the law named `law`, as a multiple of the law's stiffness.
/// Returns 0 for a law without elastic part, and 1 for an unknown name.
double steepest_slope_factor(std::string_view law, const CouplingParameters& parameters) noexcept;

}  // namespace tandem::haptics
