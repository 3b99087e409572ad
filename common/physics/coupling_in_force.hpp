// Coupling of a scene (law and coefficients), and the coefficients that currently apply to one tool.
#pragma once

#include <optional>
#include <string_view>

#include "common/base/mass_properties.hpp"
#include "common/haptics/coupling/adaptive.hpp"
#include "common/haptics/coupling/laws.hpp"

namespace tandem::physics {

/// Coupling of a scene in the form that the world uses. Copying it does not allocate.
struct SceneCoupling {
  std::string_view law = haptics::kDefaultCouplingLaw;  ///< one of the names in coupling_laws()
  haptics::CouplingParameters parameters;
  std::optional<haptics::AdaptiveFit> fit;  ///< fit of the coefficients for the adaptive law; unused with any other law
  haptics::ToolDynamics dynamics = haptics::ToolDynamics::kWithMass;
};

/// Mass that a coupling moves: the mass of the tool, or of the body that the tool holds.
struct MovedMass {
  double mass_kg = 0;
  double inertia_kg_m2 = 0;  ///< mean of the principal moments of inertia
  bool is_held_body = false;
};

/// Returns the moved mass of a coupling.
/// In      mass  mass of the tool, or of the body that it holds
inline MovedMass moved_mass(const MassProperties& mass, bool is_held_body) noexcept {
  return {mass.mass_kg, mass.principal_inertia_kg_m2.mean(), is_held_body};
}

/// Returns the coefficients that apply to a tool. With the adaptive law, they depend on the moved mass. A massless tool
/// that holds nothing has no damping, because damping would keep it from reaching the equilibrium of spring and contact
/// in each step.
haptics::CouplingParameters coupling_in_force(const SceneCoupling& coupling, const MovedMass& moved) noexcept;
/// Returns whether the law determines this coefficient. Such a coefficient cannot be set by the user.
bool is_chosen_by_law(const SceneCoupling& coupling, double haptics::CouplingParameters::*coefficient) noexcept;

}  // namespace tandem::physics
