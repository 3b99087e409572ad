#include "server/assets/scene_effects.hpp"

#include <algorithm>
#include <type_traits>

#include "common/physics/effects/catalog.hpp"
#include "proto/effects_from_wire.hpp"
#include "server/assets/scene_checks.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxLabelBytes = 64;

/// Any number: ranges are those of find_problem().
constexpr double kAnyMagnitude = 1e300;

void complete_model(wire::Viscosity& model, const SceneField& /*field*/) {
  const physics::Viscosity fallback;
  if (!model.has_damping_n_s_per_m()) model.set_damping_n_s_per_m(fallback.damping_n_s_per_m);
  if (!model.has_damping_n_m_s_per_rad()) model.set_damping_n_m_s_per_rad(fallback.damping_n_m_s_per_rad);
}

void complete_model(wire::ConstantField& model, const SceneField& field) {
  field.in("force_n").complete_vec3(*model.mutable_force_n(), physics::ConstantField{}.force_n, kAnyMagnitude);
}

void complete_model(wire::Magnet& model, const SceneField& field) {
  const physics::Magnet fallback;
  if (!model.has_peak_force_n()) model.set_peak_force_n(fallback.peak_force_n);
  if (!model.has_range_m()) model.set_range_m(fallback.range_m);
  field.in("core_size_m").complete_vec3(*model.mutable_core_size_m(), fallback.core_size_m, kAnyMagnitude);
}

void complete_model(wire::Vibration& model, const SceneField& field) {
  const physics::Vibration fallback;
  if (!model.has_frequency_hz()) model.set_frequency_hz(fallback.frequency_hz);
  if (!model.has_amplitude_n()) model.set_amplitude_n(fallback.amplitude_n);
  if (!model.has_decay_s()) model.set_decay_s(fallback.decay_s);
  field.in("direction").complete_vec3(*model.mutable_direction(), fallback.direction, kAnyMagnitude);
}

void complete_model(wire::Texture& model, const SceneField& /*field*/) {
  const physics::Texture fallback;
  if (!model.has_height_m()) model.set_height_m(fallback.height_m);
  if (!model.has_period_x_m()) model.set_period_x_m(fallback.period_x_m);
  if (!model.has_period_y_m()) model.set_period_y_m(fallback.period_y_m);
}

void complete_model(wire::StickSlip& model, const SceneField& /*field*/) {
  const physics::StickSlip fallback;
  if (!model.has_stiffness_n_per_m()) model.set_stiffness_n_per_m(fallback.stiffness_n_per_m);
  if (!model.has_breakaway_force_n()) model.set_breakaway_force_n(fallback.breakaway_force_n);
  if (!model.has_slip_force_n()) model.set_slip_force_n(std::min(fallback.slip_force_n, model.breakaway_force_n()));
}

enum class Owner { kBody, kScene };

void complete_common(wire::Effect& effect, Owner owner, const SceneField& field) {
  const physics::EffectSettings fallback;
  complete(*effect.mutable_placement(), field.in("placement"));
  if (effect.has_box() && effect.box().size_m_size() != 3) {
    field.in("box").in("size_m").refuse("has " + std::to_string(effect.box().size_m_size()) +
                                        " numbers; it must have 3 (full edge lengths x, y, z)");
  }
  const bool has_region = effect.has_box() || effect.has_sphere();
  if (!effect.has_in_contact()) {
    effect.set_in_contact(owner == Owner::kBody && !has_region && !effect.has_magnet());
  }
  if (!effect.has_fade_m()) effect.set_fade_m(fallback.fade_m);
  if (!effect.has_full_contact_n()) effect.set_full_contact_n(fallback.full_contact_n);
  if (!effect.has_force_limit_n()) effect.set_force_limit_n(fallback.force_limit_n);
  if (!effect.has_torque_limit_n_m()) effect.set_torque_limit_n_m(fallback.torque_limit_n_m);
}

/// A scene's effects have no surface.
void check_surface(const wire::Effect& effect, const SceneField& field) {
  if (effect.in_contact()) {
    field.in("in_contact").refuse("is true; a scene has no surface to press on: attach the effect to a body");
  }
  if (effect.has_texture()) field.in("texture").refuse("has no surface to be on; attach the effect to a body");
}

void complete(wire::Effect& effect, Owner owner, double step_rate_hz, const SceneField& field) {
  if (effect.label().size() > kMaxLabelBytes) {
    field.in("label").refuse("has " + std::to_string(effect.label().size()) + " bytes; it must have at most " +
                             std::to_string(kMaxLabelBytes));
  }
  const auto fill = [&field](const char* name, auto& model) { complete_model(model, field.in(name)); };
  if (!proto::visit_model(effect, fill)) {
    field.refuse("has no kind; it must have one of " + physics::listed_effect_names());
  }
  complete_common(effect, owner, field);
  if (owner == Owner::kScene) check_surface(effect, field);
  if (const auto problem = physics::find_problem(proto::settings_of(effect))) {
    field.in(problem->field).refuse("is " + problem->value + "; it must be " + problem->demand);
  }
  const double highest_hz = kMaxVibrationShare * step_rate_hz;
  if (effect.has_vibration() && effect.vibration().frequency_hz() > highest_hz) {
    field.in("vibration")
        .in("frequency_hz")
        .refuse("is " + number_text(effect.vibration().frequency_hz()) + "; it must be at most " +
                number_text(highest_hz) + ", 0.4 times step_rate_hz: lower it, or raise the rate");
  }
}

}  // namespace

void complete_effects(wire::Scene& scene, const SceneField& file) {
  std::size_t count = static_cast<std::size_t>(scene.effects_size());
  for (const wire::Body& body : scene.bodies()) count += static_cast<std::size_t>(body.effects_size());
  if (count > kMaxEffects) {
    file.in("effects").refuse("and those of the bodies are " + std::to_string(count) + " effects; at most " +
                              std::to_string(kMaxEffects) + " are possible");
  }
  for (int i = 0; i < scene.bodies_size(); ++i) {
    const SceneField body = file.in("bodies", static_cast<std::size_t>(i));
    for (int k = 0; k < scene.bodies(i).effects_size(); ++k) {
      complete(*scene.mutable_bodies(i)->mutable_effects(k), Owner::kBody, scene.step_rate_hz(),
               body.in("effects", static_cast<std::size_t>(k)));
    }
  }
  for (int k = 0; k < scene.effects_size(); ++k) {
    complete(*scene.mutable_effects(k), Owner::kScene, scene.step_rate_hz(),
             file.in("effects", static_cast<std::size_t>(k)));
  }
}

std::string unknown_effect_field_remedy(const std::string& field) {
  if (field.find("effects[") == std::string::npos) return {};
  return "is not a field of an effect; its kind is one of " + physics::listed_effect_names() +
         ", and its other fields stand in proto/tandem/scene.proto";
}

}  // namespace tandem::server
