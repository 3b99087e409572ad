// See scene_coupling.hpp.
#include "client/haptics/scene_coupling.hpp"

#include <string_view>

#include "common/haptics/coupling/coupling_ranges.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/rendered_coupling.hpp"

namespace tandem::client {
namespace {

std::vector<std::unique_ptr<haptics::CouplingLaw>> all_laws() {
  std::vector<std::unique_ptr<haptics::CouplingLaw>> laws;
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws())
    laws.push_back(law.make(haptics::CouplingParameters{}));
  return laws;
}

}  // namespace

SceneCoupling::SceneCoupling(const haptics::CouplingParameters& device_bounds)
    : device_bounds_(device_bounds), laws_(all_laws()), law_(laws_.front().get()) {}

bool SceneCoupling::is_usable(const HapticScene& scene) noexcept {
  return scene.law < haptics::coupling_laws().size() && haptics::is_usable(scene.coupling);
}

void SceneCoupling::go_to(const HapticScene& scene) noexcept {
  const std::string_view law = laws_[scene.law]->name();
  ramp_.go_to(haptics::rendered_coupling(law, scene.coupling,
                                         haptics::coupling_bounds_in_world(device_bounds_, scene.workspace)));
}

void SceneCoupling::start(const HapticScene& scene) noexcept {
  go_to(scene);
  law_ = laws_[scene.law].get();
  jump();
}

void SceneCoupling::jump() noexcept {
  ramp_.jump_to(ramp_.target());
  law_->set_parameters(ramp_.now());
}

void SceneCoupling::advance(LocalTime now) noexcept {
  if (ramp_.advance(to_seconds(now - advanced_at_))) law_->set_parameters(ramp_.now());
  advanced_at_ = now;
}

}  // namespace tandem::client
