#include "common/physics/effects/effect_settings.hpp"

#include <array>
#include <cmath>
#include <cstdio>

namespace tandem::physics {
namespace {

/// Names in the order of EffectModel.
constexpr std::array<std::string_view, std::variant_size_v<EffectModel>> kNames = {
    "viscosity", "constant_field", "magnet", "vibration", "texture", "stick_slip"};

std::string text_of(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

std::string text_of(const Vec3& value) {
  return text_of(value.x()) + " " + text_of(value.y()) + " " + text_of(value.z());
}

std::string refusal(const std::string& field, const std::string& value, const std::string& demand) {
  return field + " is " + value + "; it must be " + demand;
}

/// Returns the first non-empty text.
std::string first(std::initializer_list<std::string> problems) {
  for (const std::string& problem : problems) {
    if (!problem.empty()) return problem;
  }
  return {};
}

std::string not_positive(const std::string& field, double value) {
  return value > 0 && std::isfinite(value) ? "" : refusal(field, text_of(value), "more than 0 and finite");
}

std::string negative(const std::string& field, double value) {
  return value >= 0 && std::isfinite(value) ? "" : refusal(field, text_of(value), "0 or more and finite");
}

/// Checks a direction or force whose length must not be zero.
std::string no_vector(const std::string& field, const Vec3& value) {
  return is_finite(value) && value.norm() > 1e-9 ? "" : refusal(field, text_of(value), "of some length and finite");
}

std::string find_problem_of(const Viscosity& model) {
  return first({negative("viscosity.damping_n_s_per_m", model.damping_n_s_per_m),
                negative("viscosity.damping_n_m_s_per_rad", model.damping_n_m_s_per_rad)});
}

std::string find_problem_of(const ConstantField& model) {
  return no_vector("constant_field.force_n", model.force_n);
}

std::string find_problem_of(const Magnet& model) {
  return first({not_positive("magnet.peak_force_n", model.peak_force_n), not_positive("magnet.range_m", model.range_m),
                negative("magnet.core_size_m[0]", model.core_size_m.x()),
                negative("magnet.core_size_m[1]", model.core_size_m.y()),
                negative("magnet.core_size_m[2]", model.core_size_m.z())});
}

std::string find_problem_of(const Vibration& model) {
  return first({not_positive("vibration.frequency_hz", model.frequency_hz),
                not_positive("vibration.amplitude_n", model.amplitude_n), negative("vibration.decay_s", model.decay_s),
                no_vector("vibration.direction", model.direction)});
}

std::string find_problem_of(const Texture& model) {
  return first({not_positive("texture.height_m", model.height_m), not_positive("texture.period_x_m", model.period_x_m),
                negative("texture.period_y_m", model.period_y_m)});
}

std::string find_problem_of(const StickSlip& model) {
  const double slip_n = model.slip_force_n;
  const std::string demand = "from 0 to breakaway_force_n, " + text_of(model.breakaway_force_n);
  return first({not_positive("stick_slip.stiffness_n_per_m", model.stiffness_n_per_m),
                not_positive("stick_slip.breakaway_force_n", model.breakaway_force_n),
                slip_n >= 0 && slip_n <= model.breakaway_force_n
                    ? ""
                    : refusal("stick_slip.slip_force_n", text_of(slip_n), demand)});
}

std::string find_problem_of(std::monostate /*everywhere*/) {
  return {};
}

std::string find_problem_of(const BoxRegion& region) {
  return first({not_positive("box.size_m[0]", region.size_m.x()), not_positive("box.size_m[1]", region.size_m.y()),
                not_positive("box.size_m[2]", region.size_m.z())});
}

std::string find_problem_of(const SphereRegion& region) {
  return not_positive("sphere.radius_m", region.radius_m);
}

/// Checks that a magnet has neither a region nor a contact condition. Its force is conservative only if nothing but its
/// range limits it.
std::string misplaced_magnet(const EffectSettings& settings) {
  if (!std::holds_alternative<Magnet>(settings.model)) return {};
  const std::string demand = "left out for a magnet, which acts within its range_m of its core_size_m";
  if (!std::holds_alternative<std::monostate>(settings.region)) return refusal("region", "given", demand);
  if (settings.in_contact) return refusal("in_contact", "true", demand);
  return {};
}

}  // namespace

std::string_view effect_name(const EffectModel& model) noexcept {
  return kNames[model.index()];
}

std::string listed_effect_names() {
  std::string names;
  for (const std::string_view name : kNames) names += (names.empty() ? "" : ", ") + std::string(name);
  return names;
}

std::string find_problem(const EffectSettings& settings) {
  const auto check = [](const auto& part) { return find_problem_of(part); };
  if (!is_finite(settings.X_OE) || std::abs(settings.X_OE.q.norm() - 1) > 1e-6) {
    return refusal("placement", "no pose", "a finite position and a rotation");
  }
  return first({std::visit(check, settings.region), not_positive("fade_m", settings.fade_m),
                not_positive("full_contact_n", settings.full_contact_n),
                not_positive("force_limit_n", settings.force_limit_n),
                not_positive("torque_limit_n_m", settings.torque_limit_n_m), std::visit(check, settings.model),
                misplaced_magnet(settings)});
}

}  // namespace tandem::physics
