// The coupling of a scene file: defaults, checks, and what the world makes of it.
#pragma once

#include "common/physics/coupling_in_force.hpp"
#include "proto/coupling_fields.hpp"
#include "server/assets/scene_field.hpp"

namespace tandem::server {

/// Fills in every default of scene.coupling and refuses the first field that cannot be. The ranges are those of the
/// wire, so that a scene's clients accept what its server does.
void complete_coupling(wire::Coupling& coupling, const SceneField& file);
/// Of a complete description.
physics::SceneCoupling scene_coupling(const wire::Coupling& coupling);

inline bool is_chosen_by_law(const physics::SceneCoupling& coupling, const proto::CouplingField& field) noexcept {
  return physics::is_chosen_by_law(coupling, field.value);
}

}  // namespace tandem::server
