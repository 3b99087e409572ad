// What joins hands and tools in a scene: the law, its coefficients, and what is in force for one tool.
#pragma once

#include <optional>

#include "common/coupling/adaptive.hpp"
#include "proto/coupling_fields.hpp"
#include "server/scene_field.hpp"

namespace tandem {

/// A scene's coupling as the world uses it.
struct SceneCoupling {
  CouplingParameters parameters;
  std::optional<AdaptiveFit> fit;  ///< of the law `adaptive` alone
  ToolDynamics dynamics = ToolDynamics::kWithMass;
};

/// What a coupling moves: a tool, or the body that it holds.
struct MovedMass {
  double mass_kg = 0;
  double inertia_kg_m2 = 0;  ///< mean principal
  bool is_held_body = false;
};

/// Fills in every default of scene.coupling and refuses the first field that cannot be. The ranges are those of the
/// wire, so that a scene's clients accept what its server does.
void complete_coupling(wire::Coupling& coupling, const SceneField& file);
/// Of a complete description.
SceneCoupling scene_coupling(const wire::Coupling& coupling);

/// `base` as it is in force for a tool: by the fit for what it moves, and without damping where the tool has no mass,
/// for that would hold it back from where spring and contact balance.
CouplingParameters coupling_in_force(const SceneCoupling& coupling, const CouplingParameters& base,
                                     const MovedMass& moved) noexcept;
/// The law chooses this coefficient itself: nobody can set it.
bool is_chosen_by_law(const SceneCoupling& coupling, const CouplingField& field) noexcept;

}  // namespace tandem
