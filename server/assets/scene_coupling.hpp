// The coupling of a scene file: defaults, checks, and the fit of the adaptive law.
#pragma once

#include <optional>

#include "common/haptics/coupling/adaptive.hpp"
#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// Fills in every default of scene.coupling and refuses the first field that cannot be. The ranges are those of the
/// wire, so that a scene's clients accept what its server does.
void complete_coupling(wire::Coupling& coupling, const SceneField& file);
/// Of a complete description; none for a law that has no fit.
std::optional<haptics::AdaptiveFit> adaptive_fit(const wire::Coupling& coupling);

}  // namespace tandem::server
