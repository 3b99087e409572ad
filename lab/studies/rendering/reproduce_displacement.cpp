// Sag, the disadvantage of a soft coupling: a tool of mass m hangs m·g/k below the handle, even in free air.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "common/haptics/coupling/adaptive.hpp"
#include "lab/report/format.hpp"
#include "lab/studies/conventions.hpp"
#include "lab/studies/rendering/hand_rig.hpp"
#include "lab/studies/rendering/law_curves.hpp"
#include "lab/studies/rendering/reproduce_laws.hpp"

namespace tandem::lab {
namespace {

constexpr double kInertia_kg_m2 = 4e-5;
/// Masses of the tool. The weight of the heaviest exceeds 5.2 N, at which saturation begins (the knee).
constexpr std::array kMasses_kg{0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6};
/// Number of masses, from the first, with published results. The adaptive law is calibrated for these.
constexpr std::size_t kPublishedMasses = 4;
constexpr std::array kLaws{"spring-damper", "qsa-dynamic", "stable-dynamic", "stable-dynamic-literal", "adaptive"};
/// Parameter c of the stable dynamic law, the sharpness of its force curve.
constexpr double kSharpness = 1;
/// Laws with a tool that has no weight.
constexpr std::array kWeightless{"qsa-static", "direct"};
/// Time after which the sag is measured. Above the knee a curve is almost flat, so settling is slow.
constexpr double kSettling_s = 15;

haptics::CouplingParameters adaptive_coupling(double mass_kg) {
  haptics::CouplingParameters base;
  base.force_limit_n = kForceLimit_n;
  base.saturation_softness = kSoftness;
  base.curve_sharpness = kSharpness;
  return haptics::adapted(haptics::thesis_adaptive_fit(), mass_kg, kInertia_kg_m2, base);
}

/// Returns the coupling for a law. Every law gets the stiffness k_t that the adaptive law has at the lightest mass.
haptics::CouplingParameters coupling_of(std::string_view law, double mass_kg) {
  haptics::CouplingParameters coupling = adaptive_coupling(law == "adaptive" ? mass_kg : kMasses_kg.front());
  // Damping does not affect the sag. At 0.7 of critical damping the tool settles fastest.
  coupling.damping_n_s_per_m = 1.4 * std::sqrt(coupling.stiffness_n_per_m * mass_kg);
  return coupling;
}

/// Returns the stiffness of the published fit for a tool of this mass. The stiffness is constant outside the masses of
/// the fit.
double adaptive_n_per_m(double mass_kg) {
  return 116.53 * std::clamp(mass_kg, 0.05, 0.2) + 16.21;
}

/// Inverts the saturation: returns the elastic force that saturation reduces to `shown_n`.
double unbent_n(double shown_n) {
  const double knee_n = (1 - kSoftness) * kForceLimit_n;
  if (shown_n <= knee_n) return shown_n;
  return knee_n - kSoftness * kForceLimit_n * std::log((kForceLimit_n - shown_n) / (kSoftness * kForceLimit_n));
}

/// Returns the expected sag of the tool below the handle. The formulas are written out here, so that they test the code
/// of the laws independently.
///
/// Model   The elastic force is e = m g (below the knee). d_max = F_max/k_t.
///         * linear law: e/k
///         * QSA: −d_max ln(1 − e/F_max)
///         * stable dynamic law: d_max √(−ln(1 − e/F_max)/c)
double closed_form_sag_m(std::string_view law, double mass_kg) {
  const double elastic_n = unbent_n(weight_n(mass_kg));
  if (law == "adaptive") return elastic_n / adaptive_n_per_m(mass_kg);
  const double k_t = adaptive_n_per_m(kMasses_kg.front());
  if (law == "spring-damper") return elastic_n / k_t;
  const double d_max_m = kForceLimit_n / k_t;
  const double log_left = -std::log(1 - elastic_n / kForceLimit_n);
  return d_max_m * (law == "qsa-dynamic" ? log_left : std::sqrt(log_left / kSharpness));
}

/// Simulates the sag. The tool starts at the height of the handle, which does not move, and settles.
double sag_m(std::string_view law, const haptics::CouplingParameters& coupling, double mass_kg) {
  HandRigSettings settings;
  settings.law = law;
  settings.coupling = coupling;
  settings.tool_mass_kg = mass_kg;
  settings.tool_inertia_kg_m2 = Vec3::Constant(kInertia_kg_m2);
  settings.gravity_m_per_s2 = -kGravity_m_per_s2 * Vec3::UnitZ();
  HandRig rig(settings, devices::named_hand_path("rest"));
  HandRigTick last;
  for (double at_s = 0; at_s < kSettling_s; at_s += 1 / settings.rate_hz) last = rig.tick_driven(Vec3::Zero());
  return last.X_WH.p.z() - last.X_WT.p.z();
}

struct LawSag {
  std::string law;
  std::vector<double> sags_m;  ///< sag for each mass in kMasses_kg
  double worst_error = 0;      ///< largest relative error compared with the closed form

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
    const haptics::CouplingParameters coupling = coupling_of(law, mass_kg);
    result.sags_m.push_back(sag_m(law, coupling, mass_kg));
    const double ratio = result.sags_m.back() / closed_form_sag_m(law, mass_kg);
    result.worst_error = std::max(result.worst_error, std::abs(ratio - 1));
  }
  return result;
}

std::string percent(double ratio) {
  return format_fixed(100 * ratio, 1) + " %";
}
std::string millimetres(double length_m) {
  return format_fixed(1e3 * length_m, 1) + " mm";
}

/// Returns, as text, the stiffness k_t with which `law` would have the published sag. The force of a law depends only
/// on the product k_t·d with the displacement d, so the sag is proportional to 1/k_t.
std::string implied_stiffness(const LawSag& law, double ours_m, double published_m) {
  const double ours_n_per_m = coupling_of(law.law, kMasses_kg.front()).stiffness_n_per_m;
  return format_fixed(ours_n_per_m * ours_m / published_m, 1) + " N/m";
}

struct PublishedRatio {
  const char* law;
  double at_end;          ///< displacement with this law relative to that with the adaptive law, at 0.2 kg
  double mean_reduction;  ///< fraction by which the adaptive law reduces the mean displacement of this law
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

/// Adds a row of a second comparison: the stiffness k_t of the default law is chosen such that its sag equals that of
/// the adaptive law at the lightest mass. The laws then have different k_t. This comparison favours a law whose force
/// curve becomes steeper with the displacement.
void add_equal_sag_row(Reproduction& result, const LawSag& adaptive) {
  constexpr std::string_view kCurved = haptics::kDefaultCouplingLaw;
  haptics::CouplingParameters coupling = coupling_of(kCurved, kMasses_kg.front());
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

/// Adds rows for the laws whose tool has no weight. They are simulated like the other laws, so that the absence of sag
/// is measured and not assumed.
void add_weightless_rows(Reproduction& result) {
  for (const char* law : kWeightless) {
    const bool is_at_handle = haptics::find_coupling_law(law)->tool == haptics::ToolDynamics::kAtHandle;
    const std::string why = is_at_handle ? "the tool is where the handle is" : "the tool has no mass, so no weight";
    const double sag = sag_m(law, coupling_of(law, kMasses_kg.front()), kMasses_kg.front());
    result.rows.push_back({std::string(law) + ", sag at 0.05 kg", "", millimetres(sag) + ": " + why});
  }
}

double growth_per_mass(const LawSag& law, std::size_t i) {
  return law.sags_m[i + 1] / law.sags_m[i] * kMasses_kg[i] / kMasses_kg[i + 1];
}

void add_claims(Reproduction& result, const std::vector<LawSag>& sags) {
  for (const LawSag& law : sags) {
    const bool is_linear = law.law == "spring-damper" || law.law == "adaptive";
    const std::string k = is_linear ? "" : ", k the secant of its curve at m·g,";
    result.claims.push_back({law.law, "sag in free air differs from m·g/k" + k + " by", 100 * law.worst_error,
                             Relation::kAtMost, 2, "%", 3});
  }
  const LawSag& linear = of_law(sags, "spring-damper");
  const LawSag& adaptive = of_law(sags, "adaptive");
  double from_line = 0, steepest_growth = 0, highest_share = 0;
  for (std::size_t i = 0; i + 1 < kPublishedMasses; ++i) {
    from_line = std::max(from_line, std::abs(growth_per_mass(linear, i) - 1));
    steepest_growth = std::max(steepest_growth, growth_per_mass(adaptive, i));
  }
  for (std::size_t i = 1; i < kMasses_kg.size(); ++i) {
    for (const LawSag& law : sags) {
      if (law.law != adaptive.law) highest_share = std::max(highest_share, adaptive.sags_m[i] / law.sags_m[i]);
    }
  }
  result.claims.push_back({"spring-damper", "sag per mass changes from mass to mass by, 0.05 to 0.2 kg",
                           100 * from_line, Relation::kAtMost, 0.1, "%", 4});
  result.claims.push_back({"adaptive", "sag grows less than the mass, 0.05 to 0.2 kg: growth over that of the mass",
                           steepest_growth, Relation::kBelow, 1, "", 3});
  result.claims.push_back({"adaptive", "sag over that of any other law of equal k_t at 0.05 kg, 0.1 to 0.6 kg",
                           highest_share, Relation::kBelow, 1, "", 3});
}

Plot figure_of(const std::vector<LawSag>& sags) {
  Plot figure;
  figure.caption = "Sag in free air against mass, simulated; all laws have the same k_t at 0.05 kg";
  figure.description = figure.caption;
  figure.x = {.quantity = "mass of the tool", .unit = "kg"};
  figure.y = {.quantity = "sag", .unit = "mm"};
  figure.y.low = 0;
  for (const LawSag& law : sags) {
    std::vector<double> sags_mm;
    // Omits points above the knee, because the large sag of the QSA curve would flatten all other curves.
    for (std::size_t i = 0; i + 1 < kMasses_kg.size(); ++i) sags_mm.push_back(1e3 * law.sags_m[i]);
    figure.series.push_back(series_of(law.law, {kMasses_kg.begin(), kMasses_kg.end() - 1}, sags_mm));
  }
  return figure;
}

boost::json::value details_of(const std::vector<LawSag>& sags) {
  boost::json::object laws;
  for (const LawSag& law : sags) {
    laws[law.law] = {{"sag_m", boost::json::value_from(law.sags_m)},
                     {"worst_error", law.worst_error},
                     {"k_t_at_0.05_kg_n_per_m", coupling_of(law.law, kMasses_kg.front()).stiffness_n_per_m}};
  }
  return {{"settings",
           {{"force_limit_n", kForceLimit_n},
            {"softness", kSoftness},
            {"sharpness", kSharpness},
            {"gravity_m_per_s2", kGravity_m_per_s2},
            {"adaptive_n_per_m", "116.53 m + 16.21, m held within 0.05 to 0.2 kg"},
            {"settling_s", kSettling_s}}},
          {"mass_kg", boost::json::value_from(std::vector<double>(kMasses_kg.begin(), kMasses_kg.end()))},
          {"laws", laws}};
}

}  // namespace

Reproduction reproduce_displacement(const Clock&) {
  Reproduction result;
  result.title = "Displacement of a coupled tool by its weight";
  result.summary =
      "The handle is held still; the tool hangs from it until it rests. The adaptive law has the published fit, k = "
      "116.53 m + 16.21 N/m, held outside 0.05 to 0.2 kg; every other law has its k_t at 0.05 kg, F_max is 6.5 N and "
      "the softness 0.2. The stiffness of the published baselines is not published: the values that their ratios imply "
      "are given beside them. The expectation for each law is written out for this comparison, apart from the law's "
      "own code. 0.6 kg weigh more than the 5.2 N from which the force bends.";
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
  add_weightless_rows(result);
  add_equal_sag_row(result, of_law(sags, "adaptive"));
  add_claims(result, sags);
  result.figures.push_back(figure_of(sags));
  result.details = details_of(sags);
  return result;
}

}  // namespace tandem::lab
