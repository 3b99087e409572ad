#include "server/assets/scene_effects.hpp"

#include <algorithm>

#include "common/physics/effects/effect_settings.hpp"

namespace tandem::server {
namespace {

enum class Owner { kBody, kScene };

void complete(wire::Effect& effect, Owner owner) {
  effect.mutable_placement();
  const bool has_region = effect.has_box() || effect.has_sphere();
  if (!effect.has_in_contact()) {
    effect.set_in_contact(owner == Owner::kBody && !has_region && !effect.has_magnet());
  }
  if (!effect.has_stick_slip() || effect.stick_slip().has_slip_force_n()) return;
  const physics::StickSlip fallback;
  wire::StickSlip& model = *effect.mutable_stick_slip();
  const double breakaway_n = model.has_breakaway_force_n() ? model.breakaway_force_n() : fallback.breakaway_force_n;
  model.set_slip_force_n(std::min(fallback.slip_force_n, breakaway_n));
}

}  // namespace

void complete_effects(wire::Scene& scene) {
  for (wire::Body& body : *scene.mutable_bodies()) {
    for (wire::Effect& effect : *body.mutable_effects()) complete(effect, Owner::kBody);
  }
  for (wire::Effect& effect : *scene.mutable_effects()) complete(effect, Owner::kScene);
}

std::string unknown_effect_field_remedy(const std::string& field) {
  if (field.find("effects[") == std::string::npos) return {};
  return "is not a field of an effect; its kind is one of " + physics::listed_effect_names() +
         ", and its other fields are in proto/tandem/scene.proto";
}

}  // namespace tandem::server
