#include "lab/studies/rendering/law_curves.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace tandem::lab {
namespace {

std::unique_ptr<haptics::CouplingLaw> made(std::string_view name, const haptics::CouplingParameters& coupling) {
  auto law = haptics::make_coupling_law(name, coupling);
  if (law) return law;
  throw std::invalid_argument("law is \"" + std::string(name) + "\"; it must be one of " +
                              haptics::listed_coupling_law_names());
}

haptics::CouplingState along_z(double d_m, bool is_pushing) {
  haptics::CouplingState state;
  state.d_W = d_m * Vec3::UnitZ();
  // The law uses only the sign of the handle's velocity. The tool moves with the handle, so the damper exerts no force.
  state.v_WH = (is_pushing ? 1e-3 : -1e-3) * Vec3::UnitZ();
  return state;
}

}  // namespace

double elastic_force_n(const haptics::CouplingLaw& law, double d_m, bool is_pushing) {
  return law.wrench_on_tool_W(along_z(d_m, is_pushing)).f.z();
}

double displacement_m(std::string_view name, const haptics::CouplingParameters& coupling, double force_n) {
  const auto law = made(name, coupling);
  double low_m = 0;
  double high_m = 100 * coupling.force_limit_n / coupling.stiffness_n_per_m;
  if (elastic_force_n(*law, high_m, true) < force_n) {
    throw std::invalid_argument("law \"" + std::string(name) + "\" never pulls with " + std::to_string(force_n) + " N");
  }
  for (int i = 0; i < 100; ++i) {
    const double middle_m = (low_m + high_m) / 2;
    (elastic_force_n(*law, middle_m, true) < force_n ? low_m : high_m) = middle_m;
  }
  return high_m;
}

haptics::CouplingParameters with_secant_stiffness(std::string_view law, haptics::CouplingParameters coupling,
                                                  double secant_n_per_m, double at_n) {
  coupling.stiffness_n_per_m = 1;
  coupling.stiffness_n_per_m = secant_n_per_m * displacement_m(law, coupling, at_n) / at_n;
  return coupling;
}

double steepest_displacement_m(std::string_view name, const haptics::CouplingParameters& coupling) {
  const auto law = made(name, coupling);
  // Limit of the search: the displacement at which a linear curve would reach the force limit. All curves are steepest
  // at a smaller displacement.
  const double end_m = coupling.force_limit_n / coupling.stiffness_n_per_m;
  constexpr int kSamples = 4000;
  double steepest_n_per_m = 0;
  double best_m = 0;
  for (int i = 0; i <= kSamples; ++i) {
    const double d_m = end_m * i / kSamples;
    const double slope_n_per_m = law->gradient(along_z(d_m, true)).force_by_d(2, 2);
    if (slope_n_per_m <= steepest_n_per_m) continue;
    steepest_n_per_m = slope_n_per_m;
    best_m = d_m;
  }
  return best_m;
}

Series series_of(std::string_view law, std::vector<double> x, std::vector<double> y) {
  const auto laws = haptics::coupling_laws();
  const auto at = std::ranges::find(laws, law, &haptics::CouplingLawInfo::name);
  return {std::string(law), std::move(x), std::move(y), static_cast<int>(at - laws.begin())};
}

}  // namespace tandem::lab
