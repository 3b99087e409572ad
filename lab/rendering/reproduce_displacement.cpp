// Sag: the price of a soft coupling. A tool hangs m·g/k below the handle, in free air too.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "common/coupling/adaptive.hpp"
#include "lab/rendering/hand_rig.hpp"
#include "lab/rendering/law_curves.hpp"
#include "lab/rendering/reproduce_laws.hpp"
#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

using report::format_fixed;
using report::Relation;

constexpr double kGravity_m_per_s2 = 9.81;
constexpr double kInertia_kg_m2 = 4e-5;
constexpr std::array kMasses_kg{0.05, 0.1, 0.15, 0.2, 0.3, 0.4};
/// The published masses, for which the adaptive law is calibrated.
constexpr std::size_t kPublishedMasses = 4;
constexpr std::array kLaws{"spring-damper", "qsa-dynamic", "stable-dynamic", "stable-dynamic-literal", "adaptive"};
constexpr double kSettling_s = 8;

double weight_n(double mass_kg) {
  return mass_kg * kGravity_m_per_s2;
}

CouplingParameters adaptive_coupling(double mass_kg) {
  CouplingParameters base;
  base.force_limit_n = kForceLimit_n;
  base.saturation_softness = kSoftness;
  return adapted(thesis_adaptive_fit(), mass_kg, kInertia_kg_m2, base);
}

/// Of every law k_t is that of the adaptive one at the lightest mass.
CouplingParameters coupling_of(std::string_view law, double mass_kg) {
  CouplingParameters coupling = adaptive_coupling(law == "adaptive" ? mass_kg : kMasses_kg.front());
  // It does not enter the sag; 0.7 of critical gets there soonest.
  coupling.damping_n_s_per_m = 1.4 * std::sqrt(coupling.stiffness_n_per_m * mass_kg);
  return coupling;
}

/// Simulated: from level with a handle that is held still to rest.
double sag_m(std::string_view law, const CouplingParameters& coupling, double mass_kg) {
  HandRigSettings settings;
  settings.law = law;
  settings.coupling = coupling;
  settings.tool_mass_kg = mass_kg;
  settings.tool_inertia_kg_m2 = Vec3::Constant(kInertia_kg_m2);
  settings.gravity_m_per_s2 = -kGravity_m_per_s2 * Vec3::UnitZ();
  HandRig rig(settings, named_hand_path("rest"));
  HandRigTick last;
  for (double at_s = 0; at_s < kSettling_s; at_s += 1 / settings.rate_hz) last = rig.tick_driven(Vec3::Zero());
  return last.X_WH.p.z() - last.X_WT.p.z();
}

struct LawSag {
  std::string law;
  std::vector<double> sags_m;  ///< of kMasses_kg
  double worst_error = 0;      ///< against the law's own curve, relative

  double mean_published_m() const {
    double sum = 0;
    for (std::size_t i = 0; i < kPublishedMasses; ++i) sum += sags_m[i];
    return sum / kPublishedMasses;
  }
  double at_published_end_m() const { return sags_m[kPublishedMasses - 1]; }
};

LawSag measured(const std::string& law) {
  LawSag result{law, {}, 0};
  for (const double mass_kg : kMasses_kg) {
    const CouplingParameters coupling = coupling_of(law, mass_kg);
    const double expected_m = displacement_m(law, coupling, weight_n(mass_kg));
    result.sags_m.push_back(sag_m(law, coupling, mass_kg));
    result.worst_error = std::max(result.worst_error, std::abs(result.sags_m.back() / expected_m - 1));
  }
  return result;
}

std::string percent(double ratio) {
  return format_fixed(100 * ratio, 1) + " %";
}
std::string millimetres(double length_m) {
  return format_fixed(1e3 * length_m, 1) + " mm";
}

/// k_t at which `law` would have sagged by `published_m`: the curves depend on k_t d alone, so the sag goes with 1/k_t.
std::string implied_stiffness(const LawSag& law, double ours_m, double published_m) {
  const double ours_n_per_m = coupling_of(law.law, kMasses_kg.front()).stiffness_n_per_m;
  return format_fixed(ours_n_per_m * ours_m / published_m, 1) + " N/m";
}

struct PublishedRatio {
  const char* law;
  double at_end;          ///< of the adaptive law's displacement at 0.2 kg
  double mean_reduction;  ///< by the adaptive law
};
constexpr std::array kPublished{PublishedRatio{"spring-damper", 2.71, 0.5243},
                                PublishedRatio{"qsa-dynamic", 2.16, 0.4251}};

const LawSag& of_law(const std::vector<LawSag>& sags, std::string_view law) {
  return *std::ranges::find(sags, law, &LawSag::law);
}

void add_published_rows(Reproduction& result, const std::vector<LawSag>& sags) {
  const LawSag& adaptive = of_law(sags, "adaptive");
  const double end_m = adaptive.at_published_end_m();
  const double mean_m = adaptive.mean_published_m();
  for (const PublishedRatio& published : kPublished) {
    const LawSag& law = of_law(sags, published.law);
    const std::string end_stiffness = implied_stiffness(law, law.at_published_end_m(), published.at_end * end_m);
    result.rows.push_back({law.law + " against adaptive at 0.2 kg",
                           percent(published.at_end) + " (implies k_t = " + end_stiffness + ")",
                           percent(law.at_published_end_m() / end_m)});
    const std::string mean_stiffness =
        implied_stiffness(law, law.mean_published_m(), mean_m / (1 - published.mean_reduction));
    result.rows.push_back({"adaptive below " + law.law + ", mean of 0.05 to 0.2 kg",
                           percent(published.mean_reduction) + " (implies k_t = " + mean_stiffness + ")",
                           percent(1 - mean_m / law.mean_published_m())});
  }
}

/// The other way to be equal at the lightest mass: sag, not k_t. There a curve that steepens has the advantage.
void add_equal_sag_row(Reproduction& result, const LawSag& adaptive) {
  constexpr std::string_view kCurved = kDefaultCouplingLaw;
  CouplingParameters coupling = coupling_of(kCurved, kMasses_kg.front());
  const double force_n = weight_n(kMasses_kg.front());
  coupling = with_secant_stiffness(kCurved, coupling, force_n / adaptive.sags_m.front(), force_n);
  std::string ours;
  for (std::size_t i = 1; i < kPublishedMasses; ++i) {
    const double sag = displacement_m(kCurved, coupling, weight_n(kMasses_kg[i]));
    ours += (i > 1 ? ", " : "") + format_fixed(1e3 * sag, 1) + " against " + millimetres(adaptive.sags_m[i]);
  }
  result.rows.push_back(
      {std::string(kCurved) + " against adaptive at 0.1, 0.15, 0.2 kg, both level at 0.05 kg", "", ours});
}

double growth_per_mass(const LawSag& law, std::size_t i) {
  return law.sags_m[i + 1] / law.sags_m[i] * kMasses_kg[i] / kMasses_kg[i + 1];
}

void add_claims(Reproduction& result, const std::vector<LawSag>& sags) {
  for (const LawSag& law : sags) {
    result.claims.push_back(
        {law.law, "sag differs from m·g/k of its curve by", 100 * law.worst_error, Relation::kAtMost, 2, "%", 3});
  }
  const LawSag& linear = of_law(sags, "spring-damper");
  const LawSag& adaptive = of_law(sags, "adaptive");
  double from_line = 0, steepest_growth = 0, highest_share = 0;
  for (std::size_t i = 0; i + 1 < kMasses_kg.size(); ++i) {
    from_line = std::max(from_line, std::abs(growth_per_mass(linear, i) - 1));
    if (i + 1 < kPublishedMasses) steepest_growth = std::max(steepest_growth, growth_per_mass(adaptive, i));
  }
  for (std::size_t i = 1; i < kMasses_kg.size(); ++i) {
    for (const LawSag& law : sags) {
      if (law.law != adaptive.law) highest_share = std::max(highest_share, adaptive.sags_m[i] / law.sags_m[i]);
    }
  }
  result.claims.push_back(
      {"spring-damper", "sag per mass changes from mass to mass by", 100 * from_line, Relation::kAtMost, 0.1, "%", 4});
  result.claims.push_back({"adaptive",
                           "sag grows with mass to the power of less than one: growth over that of the mass",
                           steepest_growth, Relation::kBelow, 1, "", 3});
  result.claims.push_back({"adaptive", "sag over that of any other law of equal k_t at 0.05 kg, 0.1 kg and more",
                           highest_share, Relation::kBelow, 1, "", 3});
}

report::Figure figure_of(const std::vector<LawSag>& sags) {
  report::Figure figure;
  figure.caption = "Sag in free air against mass, simulated; all laws have the same k_t at 0.05 kg";
  figure.plot.description = figure.caption;
  figure.plot.x.label = "mass of the tool [kg]";
  figure.plot.y.label = "sag [mm]";
  figure.plot.y.low = 0;
  for (const LawSag& law : sags) {
    std::vector<double> sags_mm;
    for (const double sag_m : law.sags_m) sags_mm.push_back(1e3 * sag_m);
    figure.plot.series.push_back(series_of(law.law, {kMasses_kg.begin(), kMasses_kg.end()}, sags_mm));
  }
  return figure;
}

boost::json::value details_of(const std::vector<LawSag>& sags) {
  boost::json::object laws;
  for (const LawSag& law : sags) {
    laws[law.law] = {{"sag_m", boost::json::value_from(law.sags_m)},
                     {"k_t_at_0.05_kg_n_per_m", coupling_of(law.law, kMasses_kg.front()).stiffness_n_per_m}};
  }
  return {{"mass_kg", boost::json::value_from(std::vector<double>(kMasses_kg.begin(), kMasses_kg.end()))},
          {"laws", laws}};
}

}  // namespace

Reproduction reproduce_displacement(const Clock&) {
  Reproduction result;
  result.title = "Displacement of a coupled tool by its weight";
  result.summary =
      "The handle is held still; the tool hangs from it until it rests. The adaptive law has the published fit, k = "
      "116.53 m + 16.21 N/m, held outside 0.05 to 0.2 kg; every other law has its k_t at 0.05 kg, F_max is 6.5 N and "
      "the softness 0.2. The stiffness of the published baselines is not published: what their ratios imply is given "
      "beside them. qsa-static and direct are left out: their tools have no weight.";
  std::vector<LawSag> sags;
  for (const char* law : kLaws) sags.push_back(measured(law));
  add_published_rows(result, sags);
  for (const LawSag& law : sags) {
    std::string ours;
    for (std::size_t i = 0; i < kPublishedMasses; ++i) {
      ours += (i > 0 ? ", " : "") + format_fixed(1e3 * law.sags_m[i], 1);
    }
    result.rows.push_back({law.law + ", sag at 0.05, 0.1, 0.15, 0.2 kg", "", ours + " mm"});
  }
  add_equal_sag_row(result, of_law(sags, "adaptive"));
  add_claims(result, sags);
  result.figures.push_back(figure_of(sags));
  result.details = details_of(sags);
  return result;
}

}  // namespace tandem::lab
