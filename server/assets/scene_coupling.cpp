#include "server/assets/scene_coupling.hpp"

#include <algorithm>
#include <memory>
#include <string>

#include "common/haptics/coupling/laws.hpp"
#include "proto/coupling_fields.hpp"

namespace tandem::server {
namespace {

constexpr std::string_view kAdaptiveLaw = "adaptive";

constexpr double most(std::string_view coefficient) {
  return proto::find_coupling_field(coefficient)->high;
}
// A scene must accept every value that a device profile may contain, so the upper limits are equal.
static_assert(haptics::kMaxFitStiffness_n_per_m == most("coupling.stiffness_n_per_m"));
static_assert(haptics::kMaxFitDamping_n_s_per_m == most("coupling.damping_n_s_per_m"));
static_assert(haptics::kMaxFitStiffness_n_m_per_rad == most("coupling.stiffness_n_m_per_rad"));
static_assert(haptics::kMaxFitDamping_n_m_s_per_rad == most("coupling.damping_n_m_s_per_rad"));

using Numbers = google::protobuf::RepeatedField<double>;

haptics::Cubic cubic_of(const Numbers& numbers) {
  haptics::Cubic cubic;
  std::copy_n(numbers.begin(), std::min<std::size_t>(cubic.c.size(), static_cast<std::size_t>(numbers.size())),
              cubic.c.begin());
  return cubic;
}

/// Fit of thesis_adaptive_fit() in the notation of scene files.
constexpr std::string_view kThesisFit =
    R"({"mass_range_kg": [0.05, 0.2], "stiffness_n_per_m": [16.21, 116.53], "damping_n_s_per_m": [0.2]})";

/// Converts a message that has passed the checks.
haptics::AdaptiveFit from_wire(const wire::AdaptiveFit& message) {
  haptics::AdaptiveFit fit;
  fit.mass_low_kg = message.mass_range_kg(0);
  fit.mass_high_kg = message.mass_range_kg(1);
  fit.stiffness_n_per_m = cubic_of(message.stiffness_n_per_m());
  fit.damping_n_s_per_m = cubic_of(message.damping_n_s_per_m());
  if (message.inertia_range_kg_m2().empty()) return fit;
  fit.inertia_low_kg_m2 = message.inertia_range_kg_m2(0);
  fit.inertia_high_kg_m2 = message.inertia_range_kg_m2(1);
  fit.stiffness_n_m_per_rad = cubic_of(message.stiffness_n_m_per_rad());
  fit.damping_n_m_s_per_rad = cubic_of(message.damping_n_m_s_per_rad());
  return fit;
}

void check_range(const Numbers& range, const SceneField& field) {
  if (range.size() != 2) {
    field.refuse("has " + std::to_string(range.size()) + " numbers; it must have 2, the lowest and the highest");
  }
  if (range[1] <= 0 || range[0] > range[1]) {
    field.refuse("is " + number_text(range[0]) + " to " + number_text(range[1]) +
                 "; the second must be positive and not below the first");
  }
}

void check_polynomial(const Numbers& coefficients, const SceneField& field) {
  if (coefficients.empty() || coefficients.size() > 4) {
    field.refuse("has " + std::to_string(coefficients.size()) + " coefficients; it must have 1 to 4");
  }
}

/// Checks that both polynomials stay within the ranges of the wire format for all arguments in `range`.
void check_values(const Numbers& range, const haptics::Cubic& stiffness, const haptics::Cubic& damping,
                  std::string_view stiffness_name, std::string_view damping_name, const SceneField& fit) {
  for (int i = 0; i <= haptics::kFitSamples; ++i) {
    const double x = range[0] + (range[1] - range[0]) * i / haptics::kFitSamples;
    const double k = stiffness(x);
    const auto check = [&](std::string_view name, double value) {
      const proto::CouplingField& field = *proto::find_coupling_field("coupling." + std::string(name));
      if (field.accepts(value)) return;
      fit.in(std::string(name))
          .refuse("gives " + number_text(value) + " for " + number_text(x) + "; it must give from " +
                  number_text(field.low) + " to " + number_text(field.high) + " over the whole range");
    };
    check(stiffness_name, k);
    check(damping_name, damping(k));
  }
}

void check_fit(const wire::AdaptiveFit& message, const SceneField& field) {
  check_range(message.mass_range_kg(), field.in("mass_range_kg"));
  check_polynomial(message.stiffness_n_per_m(), field.in("stiffness_n_per_m"));
  check_polynomial(message.damping_n_s_per_m(), field.in("damping_n_s_per_m"));
  check_values(message.mass_range_kg(), cubic_of(message.stiffness_n_per_m()), cubic_of(message.damping_n_s_per_m()),
               "stiffness_n_per_m", "damping_n_s_per_m", field);
  if (message.inertia_range_kg_m2().empty()) {
    for (const auto& [numbers, name] : {std::pair{&message.stiffness_n_m_per_rad(), "stiffness_n_m_per_rad"},
                                        std::pair{&message.damping_n_m_s_per_rad(), "damping_n_m_s_per_rad"}}) {
      if (!numbers->empty()) field.in(name).refuse("is given without inertia_range_kg_m2; give that too");
    }
    return;
  }
  check_range(message.inertia_range_kg_m2(), field.in("inertia_range_kg_m2"));
  check_polynomial(message.stiffness_n_m_per_rad(), field.in("stiffness_n_m_per_rad"));
  check_polynomial(message.damping_n_m_s_per_rad(), field.in("damping_n_m_s_per_rad"));
  check_values(message.inertia_range_kg_m2(), cubic_of(message.stiffness_n_m_per_rad()),
               cubic_of(message.damping_n_m_s_per_rad()), "stiffness_n_m_per_rad", "damping_n_m_s_per_rad", field);
}

}  // namespace

void complete_coupling(wire::Coupling& coupling) {
  if (coupling.law().empty()) coupling.set_law(std::string(haptics::kDefaultCouplingLaw));
}

void check_coupling(const wire::Coupling& coupling, const SceneField& file) {
  if (haptics::find_coupling_law(coupling.law()) == nullptr) {
    file.in("coupling.law")
        .refuse("is \"" + coupling.law() + "\", which is no law; use one of: " + haptics::listed_coupling_law_names());
  }
  const SceneField fit = file.in("coupling.adaptive");
  if (coupling.law() == kAdaptiveLaw) {
    if (!coupling.has_adaptive()) {
      fit.refuse(
          "is missing; the law \"adaptive\" needs the fit of a device: run `tandem-lab calibrate --device NAME` and "
          "copy "
          "\"adaptive\" of the profile that it writes, \"mass_kg\" as \"mass_range_kg\", \"inertia_kg_m2\" as "
          "\"inertia_range_kg_m2\", without \"source\". Hou's, which sags by 50 mm at 0.2 kg, is " +
          std::string(kThesisFit));
    }
    check_fit(coupling.adaptive(), fit);
  } else if (coupling.has_adaptive()) {
    fit.refuse("is given, but coupling.law is \"" + coupling.law() + "\"; it is of the law \"adaptive\" alone");
  }
}

std::optional<haptics::AdaptiveFit> adaptive_fit(const wire::Coupling& coupling) {
  if (!coupling.has_adaptive()) return std::nullopt;
  return from_wire(coupling.adaptive());
}

}  // namespace tandem::server
