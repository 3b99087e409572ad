// Force over displacement during loading and unloading. A law whose force is larger during unloading generates energy.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "lab/report/format.hpp"
#include "lab/studies/rendering/hand_rig.hpp"
#include "lab/studies/rendering/law_curves.hpp"
#include "lab/studies/rendering/reproduce_laws.hpp"

namespace tandem::lab {
namespace {

// Parameters at which the published law generates energy: 4 N and 20 mm, hence k_t = 200 N/m. The hand presses by 10
// mm.
constexpr double kLimit_n = 4;
constexpr double kStiffness_n_per_m = 200;
constexpr double kDepth_m = 0.010;
constexpr int kSamples = 1000;
constexpr double kSpeed_m_per_s = 0.02;
constexpr double kGrowthToolMass_kg = 0.02;
/// Compared laws. The adaptive law is omitted: at a given stiffness it equals the spring-damper.
constexpr std::array kGrowingLaws{"spring-damper", "qsa-static", "qsa-dynamic", "stable-dynamic",
                                  "stable-dynamic-literal"};
constexpr double kDamping_n_s_per_m = 0.4;

haptics::CouplingParameters coupling() {
  haptics::CouplingParameters result;
  result.stiffness_n_per_m = kStiffness_n_per_m;
  // The damping is twice k·T (stiffness times period). A damping of k·T would be enough to dissipate the energy that
  // sampling generates. At the speed of the stroke the damping force is only 0.2 % of the total force.
  result.damping_n_s_per_m = kDamping_n_s_per_m;
  result.force_limit_n = kLimit_n;
  result.saturation_softness = kSoftness;
  return result;
}

/// Curves of the law without its damper.
struct Curves {
  std::vector<double> d_m;
  std::vector<double> in_n;
  std::vector<double> out_n;
  double stored_j = 0;
  double returned_j = 0;
  double largest_jump_n = 0;  ///< largest jump of the force when only the direction of motion reverses
};

Curves curves_of(std::string_view name, double sharpness = 1) {
  haptics::CouplingParameters parameters = coupling();
  parameters.curve_sharpness = sharpness;
  const auto law = haptics::make_coupling_law(name, parameters);
  Curves result;
  for (int i = 0; i <= kSamples; ++i) {
    const double d_m = kDepth_m * i / kSamples;
    result.d_m.push_back(d_m);
    result.in_n.push_back(elastic_force_n(*law, d_m, true));
    result.out_n.push_back(elastic_force_n(*law, d_m, false));
    result.largest_jump_n = std::max(result.largest_jump_n, std::abs(result.out_n.back() - result.in_n.back()));
    if (i == 0) continue;
    const auto at = static_cast<std::size_t>(i);
    result.stored_j += kDepth_m / kSamples * (result.in_n[at] + result.in_n[at - 1]) / 2;
    result.returned_j += kDepth_m / kSamples * (result.out_n[at] + result.out_n[at - 1]) / 2;
  }
  return result;
}

/// A stroke: the handle moves 10 mm into a plane and back at constant speed.
struct Stroke {
  std::vector<double> depth_m;  ///< depth of the handle, first while loading, then while unloading
  std::vector<double> force_n;
  double gained_j = 0;  ///< energy that the hand has received over the whole stroke
};

Stroke stroke_of(std::string_view law) {
  HandRigSettings settings;
  settings.law = law;
  settings.coupling = coupling();
  settings.tool_mass_kg = kGrowthToolMass_kg;
  settings.plane_z_m = 0;
  settings.estimates_velocity = false;
  HandRig rig(settings, devices::named_hand_path("rest"));
  const double step_m = kSpeed_m_per_s / settings.rate_hz;
  const int steps = static_cast<int>(std::lround(kDepth_m / step_m));
  Stroke result;
  HandRigTick tick;
  const double start_m = rig.tick_driven(Vec3::Zero()).X_WH.p.z();
  for (int i = 0; i < 2 * steps; ++i) {
    tick = rig.tick_driven((i < steps ? -step_m : step_m) * Vec3::UnitZ());
    result.depth_m.push_back(start_m - tick.X_WH.p.z());
    result.force_n.push_back(tick.on_hand_W.f.z());
  }
  result.gained_j = -tick.hand_work_j;
  return result;
}

Plot curve_figure(const std::string& law, const Curves& curves, const Stroke& stroke) {
  Plot figure;
  figure.caption = law + ": force against displacement, curve and simulated stroke";
  figure.description = figure.caption;
  figure.x = {.quantity = "displacement", .unit = "mm"};
  figure.y = {.quantity = "force", .unit = "N"};
  const auto millimetres = [](std::vector<double> lengths) {
    for (double& length : lengths) length *= 1e3;
    return lengths;
  };
  const auto half = static_cast<std::ptrdiff_t>(stroke.force_n.size() / 2);
  // Reverses the curve of unloading, because the x values of a plot must increase.
  std::vector<double> out_m(stroke.depth_m.rbegin(), stroke.depth_m.rend() - half);
  std::vector<double> out_n(stroke.force_n.rbegin(), stroke.force_n.rend() - half);
  figure.series = {{"in", millimetres(curves.d_m), curves.in_n, 0, Draw::kLine},
                   {"out", millimetres(curves.d_m), curves.out_n, 1, Draw::kLine},
                   {"simulated, in",
                    millimetres({stroke.depth_m.begin(), stroke.depth_m.begin() + half}),
                    {stroke.force_n.begin(), stroke.force_n.begin() + half},
                    2},
                   {"simulated, out", millimetres(out_m), out_n, 3}};
  return figure;
}

void add_law(Reproduction& result, boost::json::object& details, const std::string& law) {
  const Curves curves = curves_of(law);
  const Stroke stroke = stroke_of(law);
  const auto text = [](double energy_j) { return format_fixed(1e3 * energy_j, 2) + " mJ"; };
  const bool is_literal = law == "stable-dynamic-literal";
  const std::string stored = ": stored on the way in, returned on the way out";
  result.rows.push_back({law + stored, "", text(curves.stored_j) + ", " + text(curves.returned_j)});
  if (is_literal) {
    const Curves sharper = curves_of(law, 2);
    result.rows.push_back({law + " with c = 2" + stored, "", text(sharper.stored_j) + ", " + text(sharper.returned_j)});
  }
  result.rows.push_back({law + ": the hand gains in a stroke", "", text(stroke.gained_j)});
  result.rows.push_back(
      {law + ": force change when the handle turns", "", format_fixed(curves.largest_jump_n, 3) + " N"});
  details[law] = {{"stored_j", curves.stored_j},
                  {"returned_j", curves.returned_j},
                  {"largest_jump_n", curves.largest_jump_n},
                  {"gained_in_stroke_j", stroke.gained_j}};
  result.figures.push_back(curve_figure(law, curves, stroke));
  if (haptics::find_coupling_law(law)->is_passive) {
    result.claims.push_back(
        {law, "force change when only the sign of d·v flips", curves.largest_jump_n, Relation::kAtMost, 0, "N", 3});
    result.claims.push_back(
        {law, "the hand gains in a simulated stroke", 1e6 * stroke.gained_j, Relation::kAtMost, 0, "µJ", 1});
  } else if (is_literal) {
    result.claims.push_back({law, "force change when only the sign of d·v flips, as shown", curves.largest_jump_n,
                             Relation::kAtLeast, 1, "N", 3});
    result.claims.push_back({law, "the hand gains in a simulated stroke, as shown", 1e6 * stroke.gained_j,
                             Relation::kAtLeast, 3000, "µJ", 1});
  }
}

}  // namespace

Reproduction reproduce_growth(const Clock&) {
  Reproduction result;
  result.title = "Growth of force with displacement, in and out";
  result.summary =
      "F_max 4 N, k_t 200 N/m, so d_max 20 mm; pressed by 10 mm. The curves are the laws alone; in the strokes a "
      "handle is moved at 20 mm/s into a plane and back by a 0.02 kg tool, damping 0.4 N·s/m. The literal law takes "
      "its curve on the way in and k_t on the way out: it returns more energy than was stored. Given the same "
      "k_t the adaptive law is the spring-damper.";
  boost::json::object details;
  details["settings"] = {{"force_limit_n", kLimit_n},
                         {"softness", kSoftness},
                         {"stiffness_n_per_m", kStiffness_n_per_m},
                         {"damping_n_s_per_m", kDamping_n_s_per_m},
                         {"depth_m", kDepth_m},
                         {"speed_m_per_s", kSpeed_m_per_s},
                         {"tool_mass_kg", kGrowthToolMass_kg}};
  for (const char* law : kGrowingLaws) add_law(result, details, law);
  result.details = std::move(details);
  return result;
}

}  // namespace tandem::lab
