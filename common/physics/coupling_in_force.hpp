// What joins hands and tools in a scene: the law, its coefficients, and what is in force for one tool.
#pragma once

#include <optional>
#include <string_view>

#include "common/base/mass_properties.hpp"
#include "common/haptics/coupling/adaptive.hpp"
#include "common/haptics/coupling/laws.hpp"

namespace tandem::physics {

/// A scene's coupling as the world uses it: copied without allocation.
struct SceneCoupling {
  std::string_view law = haptics::kDefaultCouplingLaw;  ///< a name of coupling_laws()
  haptics::CouplingParameters parameters;
  std::optional<haptics::AdaptiveFit> fit;  ///< for the law `adaptive`; while another is in force it rests
  haptics::ToolDynamics dynamics = haptics::ToolDynamics::kWithMass;
};

/// What a coupling moves: a tool, or the body that it holds.
struct MovedMass {
  double mass_kg = 0;
  double inertia_kg_m2 = 0;  ///< mean principal
  bool is_held_body = false;
};

/// In      mass  of the tool, or of the body that it holds
inline MovedMass moved_mass(const MassProperties& mass, bool is_held_body) noexcept {
  return {mass.mass_kg, mass.principal_inertia_kg_m2.mean(), is_held_body};
}

/// The coefficients as they are in force for a tool: by the fit for what it moves, and without damping where the tool
/// has no mass, for that would hold it back from where spring and contact balance.
haptics::CouplingParameters coupling_in_force(const SceneCoupling& coupling, const MovedMass& moved) noexcept;
/// The law chooses this coefficient itself: nobody can set it.
bool is_chosen_by_law(const SceneCoupling& coupling, double haptics::CouplingParameters::*coefficient) noexcept;

}  // namespace tandem::physics
