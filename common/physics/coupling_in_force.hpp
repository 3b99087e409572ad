// Coupling of a scene: the law, its coefficients, and the coefficients in force for one tool.
#pragma once

#include <optional>
#include <string_view>

#include "common/base/mass_properties.hpp"
#include "common/haptics/coupling/adaptive.hpp"
#include "common/haptics/coupling/laws.hpp"

namespace tandem::physics {

/// A scene's coupling as the world uses it. Copying it does not allocate.
struct SceneCoupling {
  std::string_view law = haptics::kDefaultCouplingLaw;  ///< a name from coupling_laws()
  haptics::CouplingParameters parameters;
  std::optional<haptics::AdaptiveFit> fit;  ///< for the law `adaptive`; unused while another law is in force
  haptics::ToolDynamics dynamics = haptics::ToolDynamics::kWithMass;
};

/// Mass that a coupling moves: that of a tool, or of the body that it holds.
struct MovedMass {
  double mass_kg = 0;
  double inertia_kg_m2 = 0;  ///< mean of the principal moments
  bool is_held_body = false;
};

/// In      mass  mass of the tool, or of the body that it holds
inline MovedMass moved_mass(const MassProperties& mass, bool is_held_body) noexcept {
  return {mass.mass_kg, mass.principal_inertia_kg_m2.mean(), is_held_body};
}

/// Returns the coefficients in force for a tool. The adaptive law fits them to the moved mass. A massless tool has no
/// damping, because damping would keep it from the equilibrium of spring and contact.
haptics::CouplingParameters coupling_in_force(const SceneCoupling& coupling, const MovedMass& moved) noexcept;
/// Whether the law chooses this coefficient itself, so that it cannot be set.
bool is_chosen_by_law(const SceneCoupling& coupling, double haptics::CouplingParameters::*coefficient) noexcept;

}  // namespace tandem::physics
