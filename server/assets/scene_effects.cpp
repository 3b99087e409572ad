#include "server/assets/scene_effects.hpp"

#include <algorithm>

#include "common/physics/effects/effect_settings.hpp"
#include "proto/effects_from_wire.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxLabelBytes = 64;

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

/// A scene's effects have no surface.
void check_surface(const wire::Effect& effect, const SceneField& field) {
  if (effect.in_contact()) {
    field.in("in_contact").refuse("is true; a scene has no surface to press on: attach the effect to a body");
  }
  if (effect.has_texture()) field.in("texture").refuse("has no surface to be on; attach the effect to a body");
}

void check(const wire::Effect& effect, Owner owner, double step_rate_hz, const SceneField& field) {
  if (effect.label().size() > kMaxLabelBytes) {
    field.in("label").refuse("has " + std::to_string(effect.label().size()) + " bytes; it must have at most " +
                             std::to_string(kMaxLabelBytes));
  }
  if (owner == Owner::kScene) check_surface(effect, field);
  const double highest_hz = kMaxVibrationShare * step_rate_hz;
  if (effect.has_vibration() && effect.vibration().frequency_hz() > highest_hz) {
    field.in("vibration")
        .in("frequency_hz")
        .refuse("is " + number_text(effect.vibration().frequency_hz()) + "; it must be at most " +
                number_text(highest_hz) + ", 0.4 times step_rate_hz: lower it, or raise the rate");
  }
}

}  // namespace

void complete_effects(wire::Scene& scene) {
  for (wire::Body& body : *scene.mutable_bodies()) {
    for (wire::Effect& effect : *body.mutable_effects()) complete(effect, Owner::kBody);
  }
  for (wire::Effect& effect : *scene.mutable_effects()) complete(effect, Owner::kScene);
}

void check_effects(const wire::Scene& scene, const SceneField& file) {
  if (const std::string problem = proto::find_effect_problem(scene); !problem.empty()) file.refuse(problem);
  for (int i = 0; i < scene.bodies_size(); ++i) {
    const SceneField body = file.in("bodies", static_cast<std::size_t>(i));
    for (int k = 0; k < scene.bodies(i).effects_size(); ++k) {
      check(scene.bodies(i).effects(k), Owner::kBody, scene.step_rate_hz(),
            body.in("effects", static_cast<std::size_t>(k)));
    }
  }
  for (int k = 0; k < scene.effects_size(); ++k) {
    check(scene.effects(k), Owner::kScene, scene.step_rate_hz(), file.in("effects", static_cast<std::size_t>(k)));
  }
}

std::string unknown_effect_field_remedy(const std::string& field) {
  if (field.find("effects[") == std::string::npos) return {};
  return "is not a field of an effect; its kind is one of " + physics::listed_effect_names() +
         ", and its other fields stand in proto/tandem/scene.proto";
}

}  // namespace tandem::server
