#include "common/physics/effects/effect_settings.hpp"

#include <array>
#include <cmath>
#include <cstdio>

namespace tandem::physics {
namespace {

using Problem = std::optional<EffectProblem>;

std::string text_of(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

std::string text_of(const Vec3& value) {
  return text_of(value.x()) + " " + text_of(value.y()) + " " + text_of(value.z());
}

Problem outside(const std::string& field, double value, double low, double high) {
  if (value >= low && value <= high) return {};
  return EffectProblem{field, text_of(value), "from " + text_of(low) + " to " + text_of(high)};
}

Problem not_positive(const std::string& field, double value, double high) {
  if (value > 0 && value <= high) return {};
  return EffectProblem{field, text_of(value), "more than 0, up to " + text_of(high)};
}

/// The first of several checks that found something.
Problem first(std::initializer_list<Problem> problems) {
  for (const Problem& problem : problems) {
    if (problem) return problem;
  }
  return {};
}

Problem outside(const std::string& field, const Vec3& value, double low, double high) {
  for (int i = 0; i < 3; ++i) {
    const std::string element = field + "[" + std::to_string(i) + "]";
    if (Problem problem = outside(element, value[i], low, high)) return problem;
  }
  return {};
}

/// A direction or force that must be one.
Problem no_vector(const std::string& field, const Vec3& value, double high) {
  if (Problem problem = outside(field, value, -high, high)) return problem;
  if (value.norm() > 1e-9) return {};
  return EffectProblem{field, text_of(value), "of some length"};
}

Problem find_problem_of(const Viscosity& model) {
  return first({outside("viscosity.damping_n_s_per_m", model.damping_n_s_per_m, 0, 1e3),
                outside("viscosity.damping_n_m_s_per_rad", model.damping_n_m_s_per_rad, 0, 10)});
}

Problem find_problem_of(const ConstantField& model) {
  return no_vector("constant_field.force_n", model.force_n, 100);
}

Problem find_problem_of(const Magnet& model) {
  return first({not_positive("magnet.peak_force_n", model.peak_force_n, 100),
                outside("magnet.range_m", model.range_m, 5e-4, 1),
                outside("magnet.core_size_m", model.core_size_m, 0, 10)});
}

Problem find_problem_of(const Vibration& model) {
  return first({outside("vibration.frequency_hz", model.frequency_hz, 1, 400),
                not_positive("vibration.amplitude_n", model.amplitude_n, 100),
                outside("vibration.decay_s", model.decay_s, 0, 10),
                no_vector("vibration.direction", model.direction, 1)});
}

Problem find_problem_of(const Texture& model) {
  const bool has_y = model.period_y_m != 0;
  return first({not_positive("texture.height_m", model.height_m, 0.01),
                outside("texture.period_x_m", model.period_x_m, 1e-4, 1),
                has_y ? outside("texture.period_y_m", model.period_y_m, 1e-4, 1) : Problem{}});
}

Problem find_problem_of(const StickSlip& model) {
  return first({outside("stick_slip.stiffness_n_per_m", model.stiffness_n_per_m, 1, 1e5),
                not_positive("stick_slip.breakaway_force_n", model.breakaway_force_n, 100),
                outside("stick_slip.slip_force_n", model.slip_force_n, 0, model.breakaway_force_n)});
}

Problem find_problem_of(std::monostate /*everywhere*/) {
  return {};
}

Problem find_problem_of(const BoxRegion& region) {
  for (int i = 0; i < 3; ++i) {
    if (Problem problem = not_positive("box.size_m[" + std::to_string(i) + "]", region.size_m[i], 100)) return problem;
  }
  return {};
}

Problem find_problem_of(const SphereRegion& region) {
  return not_positive("sphere.radius_m", region.radius_m, 100);
}

/// Faded by anything but its own range, a magnet would not be conservative.
Problem misplaced_magnet(const EffectSettings& settings) {
  if (!std::holds_alternative<Magnet>(settings.model)) return {};
  const std::string demand = "left out for a magnet, which acts within its range_m of its core_size_m";
  if (!std::holds_alternative<std::monostate>(settings.region)) return EffectProblem{"region", "given", demand};
  if (settings.in_contact) return EffectProblem{"in_contact", "true", demand};
  return {};
}

}  // namespace

std::optional<EffectProblem> find_problem(const EffectSettings& settings) {
  const auto check = [](const auto& part) { return find_problem_of(part); };
  if (!is_finite(settings.X_OE) || std::abs(settings.X_OE.q.norm() - 1) > 1e-6) {
    return EffectProblem{"placement", "no pose", "a finite position and a rotation"};
  }
  return first({std::visit(check, settings.region), outside("fade_m", settings.fade_m, 1e-4, 1),
                outside("full_contact_n", settings.full_contact_n, 1e-3, 100),
                outside("force_limit_n", settings.force_limit_n, 1e-3, 100),
                outside("torque_limit_n_m", settings.torque_limit_n_m, 1e-4, 10), std::visit(check, settings.model),
                misplaced_magnet(settings)});
}

}  // namespace tandem::physics
