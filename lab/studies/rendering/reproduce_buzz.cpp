// Buzz: vibration of the force that arises from a light tool, a hand with tremor and an encoder with finite steps. The
// study measures the vibration with each law.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "lab/report/format.hpp"
#include "lab/studies/rendering/law_curves.hpp"
#include "lab/studies/rendering/reproduce_laws.hpp"
#include "lab/studies/rendering/steady_press.hpp"

namespace tandem::lab {
namespace {

constexpr std::array kForces_n{0.005, 0.0075, 0.01, 0.0125, 0.015, 0.0175, 0.02, 0.03,
                               0.05,  0.1,    0.2,  0.3,    0.5,   1.0,    2.0,  3.0};
constexpr std::size_t kOneNewton = 13;
static_assert(kForces_n[kOneNewton] == 1.0);
constexpr double kLightShare = 0.005;  ///< a touch is light if its force is below this fraction of F_max
constexpr std::string_view kRival = "qsa-dynamic";
constexpr std::string_view kLiteral = "stable-dynamic-literal";
constexpr std::array kTremors_n{0.02, 0.05, 0.1, 0.2};
/// Force limit F_max of the published comparisons (6.5 N). It is tested in addition to the default limit of
/// PressSettings (4 N).
constexpr double kLargerLimit_n = kForceLimit_n;
/// Contact stiffness of a typical wall in a scene, which is much stiffer than a coupling.
constexpr double kHardPlane_n_per_m = 20000;

struct LawBuzz {
  std::string law;
  std::vector<SteadyPress> presses;  ///< one press for each force in kForces_n
};

LawBuzz buzz_of(std::string_view law, const PressSettings& settings) {
  LawBuzz result{std::string(law), {}};
  for (const double force_n : kForces_n) result.presses.push_back(press_steadily(law, force_n, settings));
  return result;
}

const LawBuzz& of_law(const std::vector<LawBuzz>& laws, std::string_view law) {
  return *std::ranges::find(laws, law, &LawBuzz::law);
}

/// Ratio of the vibration with the default law to that with the law kRival, in light touches.
struct LightTouches {
  int count = 0;
  double worst_ratio = std::numeric_limits<double>::quiet_NaN();  ///< NaN: there is no light touch, hence no result
};

LightTouches light_touches(const LawBuzz& ours, const LawBuzz& rival, const PressSettings& settings) {
  LightTouches result;
  const double light_n = kLightShare * settings.force_limit_n;
  for (std::size_t i = 0; i < kForces_n.size(); ++i) {
    const SteadyPress &a = ours.presses[i], &b = rival.presses[i];
    if (std::max(a.mean_normal_n, b.mean_normal_n) >= light_n) continue;
    const double ratio = a.rms_n / b.rms_n;
    result.worst_ratio = result.count++ == 0 ? ratio : std::max(result.worst_ratio, ratio);
  }
  return result;
}

/// Returns three ratios as text, for forces of 0.01 N, 0.015 N and 1 N. Each ratio is the RMS vibration of the force
/// with the default law, divided by that with kRival.
std::string ratios_with(const PressSettings& settings) {
  std::string text;
  for (const double force_n : {0.01, 0.015, 1.0}) {
    const double ratio = press_steadily(haptics::kDefaultCouplingLaw, force_n, settings).rms_n /
                         press_steadily(kRival, force_n, settings).rms_n;
    text += (text.empty() ? "" : ", ") + format_fixed(ratio, 2);
  }
  return text;
}

double slope_at(std::string_view law, double force_n, const PressSettings& settings) {
  const haptics::CouplingParameters coupling = equal_rig(law, settings).coupling;
  haptics::CouplingState state;
  state.d_W = displacement_m(law, coupling, force_n) * Vec3::UnitZ();
  return haptics::make_coupling_law(law, coupling)->gradient(state).force_by_d(2, 2);
}

/// Returns two values as text. The first is the slope (stiffness) of the default law at a light touch, divided by that
/// of the law kRival. The second is the force above which the default law has the larger slope [% of F_max].
std::string slope_ratio_with(const PressSettings& settings) {
  const auto ratio = [&](double force_n) {
    return slope_at(haptics::kDefaultCouplingLaw, force_n, settings) / slope_at(kRival, force_n, settings);
  };
  double low_n = kLightShare * settings.force_limit_n, high_n = settings.force_limit_n / 2;
  const std::string light = format_fixed(ratio(low_n), 2);
  while (high_n - low_n > 1e-3) {
    const double middle_n = (low_n + high_n) / 2;
    (ratio(middle_n) < 1 ? low_n : high_n) = middle_n;
  }
  return light + "; steeper from " + format_fixed(100 * high_n / settings.force_limit_n, 1) + " % on";
}

/// Range of the settled force without tremor.
struct Rest {
  double exact_n = 0;       ///< largest range over all forces, with an exact encoder
  double over_quantum = 0;  ///< largest range over all forces, in units of the force change of one encoder step
};

Rest rest_of(std::string_view law, PressSettings settings) {
  settings.tremor_rms_n = 0;
  settings.settling_s = 4;
  settings.recorded_s = 2;
  PressSettings exact = settings;
  exact.encoder_step_m = 0;
  Rest rest;
  for (const double force_n : kForces_n) {
    rest.exact_n = std::max(rest.exact_n, press_steadily(law, force_n, exact).range_n);
    const double quantum_n = encoder_quantum_n(law, force_n, settings);
    rest.over_quantum = std::max(rest.over_quantum, press_steadily(law, force_n, settings).range_n / quantum_n);
  }
  return rest;
}

std::string millinewtons(double force_n) {
  return format_significant(1e3 * force_n, 3) + " mN";
}

void add_winner_rows(Reproduction& result, const std::vector<LawBuzz>& laws) {
  // The winner is chosen among laws with a tool. Direct rendering has none, so its plane is as soft as a coupling, and
  // its forces cannot be compared with those of the other laws. It gets a row of its own.
  std::vector<const LawBuzz*> coupled;
  for (const LawBuzz& law : laws) {
    if (haptics::find_coupling_law(law.law)->tool != haptics::ToolDynamics::kAtHandle) coupled.push_back(&law);
  }
  const LawBuzz& ours = of_law(laws, haptics::kDefaultCouplingLaw);
  const LawBuzz& rival = of_law(laws, kRival);
  for (std::size_t i = 0; i < kForces_n.size(); ++i) {
    const auto rms_n = [i](const LawBuzz* law) { return law->presses[i].rms_n; };
    const LawBuzz& best = **std::ranges::min_element(coupled, {}, rms_n);
    const std::string others = best.law == ours.law ? "" : "; default " + millinewtons(rms_n(&ours));
    result.rows.push_back({"least above 30 Hz at " + format_significant(kForces_n[i], 3) + " N", "",
                           best.law + " " + millinewtons(rms_n(&best)) + others + "; " + std::string(kRival) + " " +
                               millinewtons(rms_n(&rival))});
  }
}

void add_direct_rows(Reproduction& result, const std::vector<LawBuzz>& laws, const PressSettings& settings) {
  result.rows.push_back({"direct at 1 N, plane of " + format_significant(settings.secant_n_per_m, 3) +
                             " N/m: no winner, no scene is so soft",
                         "", millinewtons(of_law(laws, "direct").presses[kOneNewton].rms_n)});
  PressSettings hard = settings;
  hard.secant_n_per_m = kHardPlane_n_per_m;
  result.rows.push_back({"direct at 1 N, plane of 20 kN/m", "", millinewtons(press_steadily("direct", 1, hard).rms_n)});
}

void add_side_rows(Reproduction& result, const PressSettings& settings) {
  PressSettings larger = settings;
  larger.force_limit_n = kLargerLimit_n;
  PressSettings damped = settings;
  damped.damping_n_s_per_m = haptics::CouplingParameters{}.damping_n_s_per_m;
  PressSettings shipped = settings;
  shipped.coupling = haptics::CouplingParameters{};

  const std::string slopes = "slope of default over " + std::string(kRival) + " at 0.5 % of F_max, F_max ";
  for (const PressSettings& with : {settings, larger}) {
    result.rows.push_back({slopes + format_significant(with.force_limit_n, 3) + " N", "", slope_ratio_with(with)});
  }
  const std::string ratio = "default over " + std::string(kRival) + " above 30 Hz at 0.01, 0.015, 1 N, ";
  for (const double tremor_n : kTremors_n) {
    PressSettings other = settings;
    other.tremor_rms_n = tremor_n;
    result.rows.push_back({ratio + "tremor " + format_significant(tremor_n, 2) + " N", "", ratios_with(other)});
  }
  result.rows.push_back({ratio + "F_max " + format_significant(kLargerLimit_n, 3) + " N", "", ratios_with(larger)});
  result.rows.push_back(
      {ratio + "damping " + format_significant(damped.damping_n_s_per_m, 3) + " N·s/m", "", ratios_with(damped)});
  result.rows.push_back({ratio + "CouplingParameters as they are by default", "", ratios_with(shipped)});
}

/// Returns the text below the figures, which describes the settings.
std::string conditions(const PressSettings& settings) {
  return "F_max " + format_significant(settings.force_limit_n, 3) + " N, " +
         format_significant(settings.damping_n_s_per_m, 3) + " N·s/m, encoder " +
         format_significant(1e3 * settings.encoder_step_m, 3) + " mm, tremor " +
         format_significant(settings.tremor_rms_n, 3) + " N";
}

void add_claims(Reproduction& result, const std::vector<LawBuzz>& laws, const PressSettings& settings) {
  const std::string law(haptics::kDefaultCouplingLaw);
  const LawBuzz& ours = of_law(laws, haptics::kDefaultCouplingLaw);
  const LawBuzz& rival = of_law(laws, kRival);
  const Rest rest = rest_of(haptics::kDefaultCouplingLaw, settings);
  const double ours_n = ours.presses[kOneNewton].rms_n;
  const double literal_n = of_law(laws, kLiteral).presses[kOneNewton].rms_n;
  const LightTouches light = light_touches(ours, rival, settings);
  const std::string with = conditions(settings);
  PressSettings still = settings;
  still.tremor_rms_n = 0;
  const std::string share = "share of qsa-dynamic's force above 30 Hz, ";
  result.claims = {
      {law, "touches compared below 0.5 % of F_max", static_cast<double>(light.count), Relation::kAtLeast, 4, "", 0},
      {law, share + "below 0.5 % of F_max (" + with + ")", light.worst_ratio, Relation::kAtMost, 1.0 / 3, "", 3},
      {law, share + "at 1 N (" + with + ")", ours_n / rival.presses[kOneNewton].rms_n, Relation::kAtMost, 1.5, "", 3},
      {law, "no limit cycle: range of the force at rest, exact encoder, no tremor", 1e3 * rest.exact_n,
       Relation::kAtMost, 0.01, "mN", 6},
      {law, "no limit cycle: range at rest over the force of an encoder step (" + conditions(still) + ")",
       rest.over_quantum, Relation::kAtMost, 1, "", 2},
      {std::string(kLiteral), "chatters, as shown: above 30 Hz at 1 N over the default (" + with + ")",
       literal_n / ours_n, Relation::kAtLeast, 10, "", 1}};
}

Plot buzz_figure(const std::vector<LawBuzz>& laws) {
  Plot figure;
  figure.caption = "Force on the hand above 30 Hz against the force that it presses with";
  figure.description = figure.caption;
  figure.x = {.quantity = "mean normal force", .unit = "N", .is_log = true};
  figure.y = {.quantity = "RMS force above 30 Hz", .unit = "mN", .is_log = true};
  figure.height_px = 420;
  for (const LawBuzz& law : laws) {
    std::vector<std::pair<double, double>> points;
    for (const SteadyPress& press : law.presses) points.emplace_back(press.mean_normal_n, 1e3 * press.rms_n);
    std::ranges::sort(points);
    std::vector<double> x, y;
    for (const auto& [mean_n, rms_mn] : points) {
      x.push_back(mean_n);
      y.push_back(rms_mn);
    }
    figure.series.push_back(series_of(law.law, x, y));
  }
  return figure;
}

Plot chatter_figure(const std::vector<LawBuzz>& laws) {
  Plot figure;
  figure.caption = "A second of a steady press with 1 N under tremor";
  figure.description = figure.caption;
  figure.x = {.quantity = "time", .unit = "s"};
  figure.y = {.quantity = "force on the hand", .unit = "N"};
  for (const std::string_view law : {kLiteral, kRival, haptics::kDefaultCouplingLaw}) {
    const std::vector<double>& force_n = of_law(laws, law).presses[kOneNewton].normal_n;
    std::vector<double> at_s;
    for (std::size_t i = 0; i < 1000; ++i) at_s.push_back(1e-3 * static_cast<double>(i));
    figure.series.push_back(series_of(law, at_s, {force_n.begin(), force_n.begin() + 1000}));
  }
  return figure;
}

boost::json::value details_of(const std::vector<LawBuzz>& laws, const PressSettings& settings) {
  boost::json::object result;
  result["settings"] = {
      {"force_limit_n", settings.force_limit_n},
      {"softness", kSoftness},
      {"secant_n_per_m", settings.secant_n_per_m},
      {"damping_n_s_per_m", settings.damping_n_s_per_m},
      {"tool_mass_kg", settings.tool_mass_kg},
      {"encoder_step_m", settings.encoder_step_m},
      {"tremor_rms_n", settings.tremor_rms_n},
      {"settling_s", settings.settling_s},
      {"recorded_s", settings.recorded_s},
      {"rate_hz", HandRigSettings{}.rate_hz},
      {"seed", settings.seed},
      {"asked_for_n", boost::json::value_from(std::vector<double>(kForces_n.begin(), kForces_n.end()))}};
  for (const LawBuzz& law : laws) {
    boost::json::array presses;
    for (const SteadyPress& press : law.presses) {
      presses.push_back(
          {{"mean_normal_n", press.mean_normal_n}, {"rms_above_30_hz_n", press.rms_n}, {"range_n", press.range_n}});
    }
    result[law.law] = std::move(presses);
  }
  return result;
}

}  // namespace

Reproduction reproduce_buzz(const Clock&) {
  const PressSettings settings;
  Reproduction result;
  result.title = "Buzz of a light tool under a trembling hand";
  result.summary =
      "A hand of 0.3 kg and 200 N/m presses a 0.02 kg tool on a plane for 8 s, 1 kHz, encoder 0.03 mm, tremor 0.05 N "
      "around 9 Hz (0.03 mm along each axis). Every law has F_max 4 N, as published with this tool, 300 N/m of secant "
      "stiffness at 1 N and 0.2 N·s/m; the adaptive law is then the spring-damper, and direct rendering gets a plane "
      "of 300 N/m, which no scene would choose, so it is left out where laws are ranked. In a light touch the slopes "
      "decide: those of stable-dynamic and the qsa curve differ by 2 √(ln(1 − F/F_max) / ln(1 − 1 N/F_max)), so a "
      "larger F_max gains less. More damping hands back the noise of the velocity, which is the same for all.";
  std::vector<LawBuzz> laws;
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) laws.push_back(buzz_of(law.name, settings));
  add_winner_rows(result, laws);
  add_direct_rows(result, laws, settings);
  add_side_rows(result, settings);
  add_claims(result, laws, settings);
  result.figures = {buzz_figure(laws), chatter_figure(laws)};
  result.details = details_of(laws, settings);
  return result;
}

}  // namespace tandem::lab
