// Z-width: the largest stiffness of a wall at which the sampled loop does not oscillate, for each law, as a function of
// damping and rate.

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "common/haptics/coupling/stability.hpp"
#include "lab/metrics/high_pass.hpp"
#include "lab/report/format.hpp"
#include "lab/studies/rendering/hand_rig.hpp"
#include "lab/studies/rendering/law_curves.hpp"
#include "lab/studies/rendering/reproduce_laws.hpp"

namespace tandem::lab {
namespace {

constexpr std::array kRates_hz{250.0, 500.0, 1000.0, 2000.0, 4000.0};
constexpr std::array kDampings_n_s_per_m{0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0};
/// Compared laws. The adaptive law is omitted: at a given stiffness it equals the spring-damper.
constexpr std::array kZWidthLaws{"spring-damper",          "qsa-static", "qsa-dynamic", "stable-dynamic",
                                 "stable-dynamic-literal", "direct"};
constexpr double kLeast_n_per_m = 50;
constexpr double kMost_n_per_m = 1e6;
constexpr double kResolution = 1.005;
/// Factor of the first search interval: it extends from the expected stiffness / kNarrow to the expected stiffness ×
/// kNarrow.
constexpr double kNarrow = 1.01;
/// Factor between successive stiffness values in the scan for switching laws.
constexpr double kScan = 1.1;
constexpr double kToolMass_kg = 0.05;
/// Parameters of a desktop device; our choice. The hand has the light grip of HandParameters.
constexpr double kDeviceMass_kg = 0.1;
constexpr double kDeviceDamping_n_s_per_m = 0.1;
/// Stiffness of the plane, so large that the tool does not move. The effective wall then has the stiffness of the
/// coupling alone.
constexpr double kPlane_n_per_m = 1e9;
/// Amplitude below which the handle counts as resting. It is 10,000 times the rounding error of the positions.
constexpr double kStill_m = 1e-14;
constexpr double kSmallSwing = 0.05;
/// Smallest preload (force on the wall) of a test, as a fraction of the force limit. A law is tested at the steepest
/// point of its curve. For some laws this point is at zero force, and without a preload the handle would leave the
/// wall.
constexpr double kMinPreload = 0.02;

/// Largest permitted difference between predicted and simulated limit. It equals two steps of the search (kResolution).
/// The largest measured difference is one step.
constexpr double kTolerance_percent = 1;

bool is_direct(std::string_view law) {
  return haptics::find_coupling_law(law)->tool == haptics::ToolDynamics::kAtHandle;
}

/// Returns whether a law is switching: its force jumps when the sign of d·v (displacement times velocity) changes. The
/// loop of such a law cannot be linearised, so no stability limit can be predicted.
bool is_switching(std::string_view law) {
  return !haptics::find_coupling_law(law)->is_passive && !is_direct(law);
}

struct Setting {
  std::string_view law;
  double rate_hz;
  double damping_n_s_per_m;
};

haptics::CouplingParameters coupling_of(const Setting& setting, double stiffness_n_per_m) {
  haptics::CouplingParameters coupling;
  coupling.stiffness_n_per_m = stiffness_n_per_m;
  coupling.damping_n_s_per_m = setting.damping_n_s_per_m;
  coupling.force_limit_n = kForceLimit_n;
  coupling.saturation_softness = kSoftness;
  return coupling;
}

/// Operating point of a law at the wall: the force with which the hand presses, and the slope of the law's curve at
/// this force divided by k_t. Both values are independent of k_t.
struct Preload {
  double force_n = 1;
  double slope_per_stiffness = 1;
};
Preload preload_of(std::string_view name) {
  if (is_direct(name)) return {};
  const haptics::CouplingParameters unit = coupling_of({name, 1000, 0}, 1);
  const double least_m = displacement_m(name, unit, kMinPreload * kForceLimit_n);
  const double d_m = std::max(steepest_displacement_m(name, unit), least_m);
  const auto law = haptics::make_coupling_law(name, unit);
  haptics::CouplingState state;
  state.d_W = d_m * Vec3::UnitZ();
  return {elastic_force_n(*law, d_m, true), law->gradient(state).force_by_d(2, 2)};
}

/// Returns the largest stiffness for which `is_stable` is true, with the relative accuracy kResolution − 1. It is
/// kLeast_n_per_m if no tried stiffness is stable. An interval around `guess` is widened by growing factors until it
/// contains the limit; then it is bisected.
template <class IsStable>
double largest_stable(double guess, const IsStable& is_stable) {
  double low = guess / kNarrow, high = guess * kNarrow;
  for (double factor = 1.1; !is_stable(low); factor *= factor) {
    if (low <= kLeast_n_per_m) return kLeast_n_per_m;
    high = low;
    low = std::max(low / factor, kLeast_n_per_m);
  }
  for (double factor = 1.1; is_stable(high); factor *= factor) {
    if (high >= kMost_n_per_m) return kMost_n_per_m;
    low = high;
    high = std::min(high * factor, kMost_n_per_m);
  }
  while (high / low > kResolution) {
    const double middle = std::sqrt(low * high);
    (is_stable(middle) ? low : high) = middle;
  }
  return low;
}

double predicted_n_per_m(const Setting& setting, const Preload& preload) {
  haptics::LoopModel model;
  model.period_s = 1 / setting.rate_hz;
  model.damping = is_direct(setting.law) ? 0 : setting.damping_n_s_per_m;
  model.tool_mass =
      haptics::find_coupling_law(setting.law)->tool == haptics::ToolDynamics::kWithMass ? kToolMass_kg : 0;
  model.device_mass = kDeviceMass_kg;
  model.device_damping = kDeviceDamping_n_s_per_m;
  model.contact_stiffness = is_direct(setting.law) ? 1e12 : kPlane_n_per_m;
  return largest_stable(std::sqrt(kLeast_n_per_m * kMost_n_per_m), [&](double stiffness) {
    model.stiffness = preload.slope_per_stiffness * stiffness;
    return haptics::spectral_radius(model) < 1;
  });
}

HandRigSettings rig_of(const Setting& setting, double stiffness_n_per_m) {
  HandRigSettings settings;
  settings.law = setting.law;
  settings.coupling = coupling_of(setting, stiffness_n_per_m);
  settings.rate_hz = setting.rate_hz;
  settings.tool_mass_kg = kToolMass_kg;
  settings.plane_z_m = 0;
  settings.contact_n_per_m = is_direct(setting.law) ? stiffness_n_per_m : kPlane_n_per_m;
  settings.hand.mass_kg += kDeviceMass_kg;
  settings.hand.damping_n_s_per_m += kDeviceDamping_n_s_per_m;
  return settings;
}

/// Returns the RMS deviation of the handle's height from its mean, over `ticks` ticks [m].
double swing_m(HandRig& rig, double ticks) {
  std::vector<double> heights_m;
  for (double i = 0; i < ticks; ++i) heights_m.push_back(rig.tick().X_WH.p.z());
  const double mean = std::accumulate(heights_m.begin(), heights_m.end(), 0.0) / static_cast<double>(heights_m.size());
  for (double& height : heights_m) height -= mean;
  return rms(heights_m);
}

/// Returns whether the hand comes to rest after it moves down onto the wall.
bool comes_to_rest(const Setting& setting, const Preload& preload, double stiffness_n_per_m) {
  const HandRigSettings settings = rig_of(setting, stiffness_n_per_m);
  const double wall_m = is_direct(setting.law) ? preload.force_n / stiffness_n_per_m
                                               : displacement_m(setting.law, settings.coupling, preload.force_n);
  const double hand_m = preload.force_n / settings.hand.stiffness_n_per_m;
  // The hand starts at the wall and moves slowly. An impact would still ring when the oscillations are compared.
  const Pose pressing{-(wall_m + hand_m) * Vec3::UnitZ(), Quat::Identity()};
  HandRig rig(settings, devices::HandPath({{Duration(0), Pose{}, 0, ""}, {from_seconds(0.8), pressing, 0, ""}}));
  swing_m(rig, 1.0 * setting.rate_hz);
  const double before_m = swing_m(rig, 0.3 * setting.rate_hz);
  swing_m(rig, 0.9 * setting.rate_hz);
  const double after_m = swing_m(rig, 0.3 * setting.rate_hz);
  // Only a small oscillation shows whether the loop is stable. A large one neither grows nor decays, because the force
  // limit or a loss of contact bounds it.
  return after_m < kStill_m || (after_m < before_m && after_m < kSmallSwing * wall_m);
}

double simulated_n_per_m(const Setting& setting, const Preload& preload, double expected_n_per_m) {
  return largest_stable(expected_n_per_m, [&](double stiffness) { return comes_to_rest(setting, preload, stiffness); });
}

/// Returns the lowest tried stiffness at which the hand does not come to rest. A bisection would fail here: for a
/// switching law, rest does not depend monotonically on the stiffness.
double lowest_restless_n_per_m(const Setting& setting, const Preload& preload) {
  double stiffness = kLeast_n_per_m;
  while (stiffness < kMost_n_per_m && comes_to_rest(setting, preload, stiffness)) stiffness *= kScan;
  return stiffness;
}

struct Width {
  double rate_hz;
  std::vector<double> predicted_n_per_m;  ///< values in the order of kDampings_n_s_per_m; empty for a switching law
  /// Limits found by simulation, in the same order. For a switching law: lowest stiffness at which the hand does not
  /// come to rest.
  std::vector<double> simulated_n_per_m;
};

struct LawWidths {
  std::string law;
  std::vector<Width> widths;  ///< one entry for each rate, in the order of kRates_hz
  double worst_disagreement = 0;
};

LawWidths widths_of(std::string_view law) {
  const Preload preload = preload_of(law);
  LawWidths result{std::string(law), {}, 0};
  for (const double rate_hz : kRates_hz) {
    Width width{rate_hz, {}, {}};
    for (const double damping : kDampings_n_s_per_m) {
      if (is_direct(law) && damping > 0) break;
      const Setting setting{law, rate_hz, damping};
      if (is_switching(law)) {
        width.simulated_n_per_m.push_back(lowest_restless_n_per_m(setting, preload));
        continue;
      }
      width.predicted_n_per_m.push_back(predicted_n_per_m(setting, preload));
      width.simulated_n_per_m.push_back(simulated_n_per_m(setting, preload, width.predicted_n_per_m.back()));
      const double ratio = width.simulated_n_per_m.back() / width.predicted_n_per_m.back();
      result.worst_disagreement = std::max(result.worst_disagreement, std::abs(ratio - 1));
    }
    result.widths.push_back(std::move(width));
  }
  return result;
}

std::string listed(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) {
    text += text.empty() ? "" : ", ";
    text += value <= kLeast_n_per_m ? "≤ " + format_significant(kLeast_n_per_m, 3) : format_significant(value, 3);
  }
  return text;
}

Plot figure_of(const LawWidths& law) {
  Plot figure;
  figure.caption = is_switching(law.law)
                       ? law.law + ": lowest k_t that does not come to rest against damping, simulated"
                       : law.law + ": largest stable k_t against damping; lines: predicted, markers: simulated";
  figure.description = figure.caption;
  figure.x = {.quantity = "damping", .unit = "N·s/m"};
  figure.y = {.quantity = "stiffness k_t", .unit = "N/m", .is_log = true};
  int color = 0;
  for (const Width& width : law.widths) {
    const std::vector<double> x(kDampings_n_s_per_m.begin(), kDampings_n_s_per_m.end());
    const std::string rate = format_significant(width.rate_hz, 4) + " Hz";
    const bool has_prediction = !width.predicted_n_per_m.empty();
    if (has_prediction) figure.series.push_back({rate, x, width.predicted_n_per_m, color, Draw::kLine});
    const Draw draw = has_prediction ? Draw::kMarkers : Draw::kLineAndMarkers;
    figure.series.push_back({has_prediction ? "" : rate, x, width.simulated_n_per_m, color++, draw});
  }
  return figure;
}

boost::json::value details_of(const LawWidths& law) {
  boost::json::array widths;
  for (const Width& width : law.widths) {
    widths.push_back({{"rate_hz", width.rate_hz},
                      {"predicted_n_per_m", boost::json::value_from(width.predicted_n_per_m)},
                      {"simulated_n_per_m", boost::json::value_from(width.simulated_n_per_m)}});
  }
  return {{"widths", widths}, {"worst_disagreement", law.worst_disagreement}};
}

void add_law(Reproduction& result, boost::json::object& details, const LawWidths& law) {
  for (const Width& width : law.widths) {
    const std::string row_name = law.law + ", " + format_significant(width.rate_hz, 4) + " Hz: ";
    if (is_switching(law.law)) {
      result.rows.push_back({row_name + "lowest k_t not at rest [N/m]", "", listed(width.simulated_n_per_m)});
      continue;
    }
    result.rows.push_back({row_name + "predicted k_t [N/m]", "", listed(width.predicted_n_per_m)});
    result.rows.push_back({row_name + "simulated k_t [N/m]", "", listed(width.simulated_n_per_m)});
  }
  details[law.law] = details_of(law);
  if (!is_direct(law.law)) result.figures.push_back(figure_of(law));
  if (is_switching(law.law)) return;
  result.claims.push_back({law.law, "prediction and simulation of the largest stable stiffness differ by at most",
                           100 * law.worst_disagreement, Relation::kAtMost, kTolerance_percent, "%", 2});
}

}  // namespace

Reproduction reproduce_zwidth(const Clock&) {
  Reproduction result;
  result.title = "Z-width of the sampled coupling";
  std::string dampings;
  for (const double damping : kDampings_n_s_per_m) {
    dampings += (dampings.empty() ? "" : ", ") + format_significant(damping, 3);
  }
  result.summary =
      "Largest stiffness k_t at which a hand of 0.3 kg and 200 N/m on a device of 0.1 kg and 0.1 N·s/m comes to rest "
      "on a wall that holds the 0.05 kg tool, for damping " +
      dampings +
      " N·s/m. Predicted: spectral radius of the loop, linear at the steepest place of the law's curve. Simulated: the "
      "hand lowers itself there; bisection to 0.5 % on whether it comes to rest. Laws that switch with the hand's "
      "direction are not linear anywhere and chatter far below such a prediction: for them the lowest stiffness that "
      "does not come to rest is shown, searched upwards from 50 N/m in steps of 10 %; some stiffer "
      "ones happen to rest. Laws that are steepest at no force are pressed with 2 % of F_max.";
  boost::json::object details;
  details["settings"] = {{"force_limit_n", kForceLimit_n},
                         {"softness", kSoftness},
                         {"tool_mass_kg", kToolMass_kg},
                         {"device_mass_kg", kDeviceMass_kg},
                         {"device_damping_n_s_per_m", kDeviceDamping_n_s_per_m},
                         {"hand_mass_kg", devices::HandParameters{}.mass_kg},
                         {"hand_n_per_m", devices::HandParameters{}.stiffness_n_per_m},
                         {"least_n_per_m", kLeast_n_per_m},
                         {"resolution", kResolution - 1},
                         {"scan_step", kScan - 1}};
  details["damping_n_s_per_m"] =
      boost::json::value_from(std::vector<double>(kDampings_n_s_per_m.begin(), kDampings_n_s_per_m.end()));
  for (const char* law : kZWidthLaws) add_law(result, details, widths_of(law));
  result.details = std::move(details);
  return result;
}

}  // namespace tandem::lab
