#include "proto/effects_from_wire.hpp"

#include "common/physics/effects/effect_settings.hpp"
#include "proto/placement.hpp"
#include "proto/scene_ranges.hpp"

namespace tandem::proto {
namespace {

/// Returns the numbers of a field as a vector; a zero vector if there are not three.
Vec3 vec3_of(const google::protobuf::RepeatedField<double>& values) {
  return values.size() == 3 ? Vec3(values[0], values[1], values[2]) : Vec3(0, 0, 0);
}

physics::Viscosity model_of(const wire::Viscosity& model) {
  return {model.damping_n_s_per_m(), model.damping_n_m_s_per_rad()};
}
physics::ConstantField model_of(const wire::ConstantField& model) {
  return {vec3_of(model.force_n())};
}
physics::Magnet model_of(const wire::Magnet& model) {
  return {model.peak_force_n(), model.range_m(), vec3_of(model.core_size_m())};
}
physics::Vibration model_of(const wire::Vibration& model) {
  return {model.frequency_hz(), model.amplitude_n(), model.decay_s(), vec3_of(model.direction())};
}
physics::Texture model_of(const wire::Texture& model) {
  return {model.height_m(), model.period_x_m(), model.period_y_m()};
}
physics::StickSlip model_of(const wire::StickSlip& model) {
  return {model.stiffness_n_per_m(), model.breakaway_force_n(), model.slip_force_n()};
}

using Effects = google::protobuf::RepeatedPtrField<wire::Effect>;

constexpr std::size_t kMaxLabelBytes = 64;
/// Maximum frequency of a vibration as a fraction of the step rate. Above it, the steps sample a sinusoid too coarsely.
constexpr double kMaxVibrationShare = 0.4;

std::string find_surface_problem(const wire::Effect& effect) {
  if (effect.in_contact()) {
    return ".in_contact is true; a scene has no surface to press on: attach the effect to a body";
  }
  return effect.has_texture() ? ".texture has no surface to be on; attach the effect to a body" : "";
}

std::string find_problem_of(const wire::Effect& effect, double step_rate_hz) {
  if (effect.kind_case() == wire::Effect::KIND_NOT_SET) {
    return " has no kind; it must have one of " + physics::listed_effect_names();
  }
  if (effect.label().size() > kMaxLabelBytes) {
    return ".label has " + std::to_string(effect.label().size()) + " bytes; it must have at most " +
           std::to_string(kMaxLabelBytes);
  }
  const double highest_hz = kMaxVibrationShare * step_rate_hz;
  if (effect.has_vibration() && effect.vibration().frequency_hz() > highest_hz) {
    return ".vibration.frequency_hz is " + number_text(effect.vibration().frequency_hz()) + "; it must be at most " +
           number_text(highest_hz) + ", 0.4 times step_rate_hz: lower it, or raise the rate";
  }
  const std::string problem = physics::find_problem(settings_of(effect));
  return problem.empty() ? problem : "." + problem;
}

/// Returns a description of the first problem; empty if there is none.
/// In      owner  prefix of field names in the text: "bodies[0]." for a body; "" for the scene, which has no surface
std::string find_problem_of(const Effects& effects, double step_rate_hz, const std::string& owner) {
  for (int i = 0; i < effects.size(); ++i) {
    std::string problem = owner.empty() ? find_surface_problem(effects[i]) : "";
    if (problem.empty()) problem = find_problem_of(effects[i], step_rate_hz);
    if (!problem.empty()) return owner + "effects[" + std::to_string(i) + "]" + problem;
  }
  return {};
}

}  // namespace

std::string find_effect_problem(const wire::Scene& scene) {
  int count = scene.effects_size();
  for (const wire::Body& body : scene.bodies()) count += body.effects_size();
  if (count > kMaxEffects) {
    return "effects and those of the bodies are " + std::to_string(count) + " effects; at most " +
           std::to_string(kMaxEffects) + " are possible";
  }
  for (int i = 0; i < scene.bodies_size(); ++i) {
    const std::string owner = "bodies[" + std::to_string(i) + "].";
    std::string problem = find_problem_of(scene.bodies(i).effects(), scene.step_rate_hz(), owner);
    if (!problem.empty()) return problem;
  }
  return find_problem_of(scene.effects(), scene.step_rate_hz(), "");
}

physics::EffectSettings settings_of(const wire::Effect& effect) {
  physics::EffectSettings settings;
  settings.X_OE = pose_from_placement(effect.placement());
  if (effect.has_box()) settings.region = physics::BoxRegion{vec3_of(effect.box().size_m())};
  if (effect.has_sphere()) settings.region = physics::SphereRegion{effect.sphere().radius_m()};
  settings.fade_m = effect.fade_m();
  settings.in_contact = effect.in_contact();
  settings.full_contact_n = effect.full_contact_n();
  settings.force_limit_n = effect.force_limit_n();
  settings.torque_limit_n_m = effect.torque_limit_n_m();
  if (effect.has_viscosity()) settings.model = model_of(effect.viscosity());
  if (effect.has_constant_field()) settings.model = model_of(effect.constant_field());
  if (effect.has_magnet()) settings.model = model_of(effect.magnet());
  if (effect.has_vibration()) settings.model = model_of(effect.vibration());
  if (effect.has_texture()) settings.model = model_of(effect.texture());
  if (effect.has_stick_slip()) settings.model = model_of(effect.stick_slip());
  return settings;
}

std::vector<physics::EffectSettings> effects_of(const wire::Scene& scene) {
  std::vector<physics::EffectSettings> effects;
  for (int i = 0; i < scene.bodies_size(); ++i) {
    for (const wire::Effect& effect : scene.bodies(i).effects()) {
      effects.push_back(settings_of(effect));
      effects.back().owner = static_cast<std::size_t>(i);
    }
  }
  for (const wire::Effect& effect : scene.effects()) effects.push_back(settings_of(effect));
  return effects;
}

}  // namespace tandem::proto
