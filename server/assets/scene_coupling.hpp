// The coupling of a scene file: its defaults, its checks, and the fit of the adaptive law.
#pragma once

#include <optional>

#include "common/haptics/coupling/adaptive.hpp"
#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

void complete_coupling(wire::Coupling& coupling);
/// Checks the coupling law of a scene. Refuses an unknown law, a missing fit if the law needs one, and a fit that the
/// law does not use.
void check_coupling(const wire::Coupling& coupling, const SceneField& file);
/// Returns the fit of the adaptive law in a complete description, or nothing for a law without a fit.
std::optional<haptics::AdaptiveFit> adaptive_fit(const wire::Coupling& coupling);

}  // namespace tandem::server
