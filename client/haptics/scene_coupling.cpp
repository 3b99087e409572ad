#include "client/haptics/scene_coupling.hpp"

#include "common/haptics/coupling/coupling_ranges.hpp"
#include "common/haptics/coupling/rendered_coupling.hpp"

namespace tandem::client {

SceneCoupling::SceneCoupling(const haptics::CouplingParameters& device_bounds) : device_bounds_(device_bounds) {}

bool SceneCoupling::is_usable(const HapticScene& scene) noexcept {
  return scene.law < haptics::coupling_laws().size() && haptics::is_usable(scene.coupling);
}

haptics::CouplingParameters SceneCoupling::rendered(const HapticScene& scene) const noexcept {
  return haptics::rendered_coupling(haptics::coupling_laws()[scene.law].name, scene.coupling,
                                    haptics::coupling_bounds_in_world(device_bounds_, scene.workspace));
}

void SceneCoupling::fade_to(const HapticScene& scene) noexcept {
  fade_.fade_to(haptics::coupling_laws()[scene.law], rendered(scene));
}

void SceneCoupling::start(const HapticScene& scene) noexcept {
  fade_.jump_to(haptics::coupling_laws()[scene.law], rendered(scene));
}

void SceneCoupling::jump() noexcept {
  fade_.jump_to(fade_.target_law(), fade_.target());
}

void SceneCoupling::advance(double period_s) noexcept {
  fade_.advance(period_s);
}

}  // namespace tandem::client
