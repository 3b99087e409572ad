// Saturation: forces below the knee are unchanged; larger forces approach the limit without reaching it.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "common/haptics/coupling/saturation.hpp"
#include "lab/report/format.hpp"
#include "lab/studies/rendering/hand_rig.hpp"
#include "lab/studies/rendering/law_curves.hpp"
#include "lab/studies/rendering/reproduce_laws.hpp"

namespace tandem::lab {
namespace {

constexpr double kKnee_n = (1 - kSoftness) * kForceLimit_n;
constexpr std::array kSaturatingMasses_kg{0.05, 0.1, 0.15, 0.2};
constexpr double kPressDepth_m = 0.07;
constexpr double kCouplingStiffness_n_per_m = 300;
constexpr double kCouplingDamping_n_s_per_m = 3;

/// Returns a path that moves down by kPressDepth_m in one second, holds, and moves up again.
devices::HandPath press() {
  using std::chrono::seconds;
  const Pose up{0.005 * Vec3::UnitZ(), Quat::Identity()};
  const Pose down{-kPressDepth_m * Vec3::UnitZ(), Quat::Identity()};
  return devices::HandPath(
      {{seconds(0), up, 0, ""}, {seconds(1), down, 0, ""}, {seconds(2), down, 0, ""}, {seconds(3), up, 0, ""}});
}

HandRigSettings pressing(std::string_view law, double mass_kg) {
  HandRigSettings settings;
  settings.law = law;
  settings.coupling.stiffness_n_per_m = kCouplingStiffness_n_per_m;
  settings.coupling.damping_n_s_per_m = kCouplingDamping_n_s_per_m;
  settings.coupling.force_limit_n = kForceLimit_n;
  settings.coupling.saturation_softness = kSoftness;
  settings.tool_mass_kg = mass_kg;
  settings.plane_z_m = 0;
  // With the exact velocity instead of an estimate, the force before saturation can be computed from the trace.
  settings.estimates_velocity = false;
  return settings;
}

/// A press of the hand: the force of the law before saturation, and the displayed force.
struct Press {
  std::vector<double> at_s;
  std::vector<double> requested_n;
  std::vector<double> shown_n;
  double largest_n = 0;          ///< largest force on the hand or the tool
  double largest_unequal_n = 0;  ///< largest |force on hand + force on tool|
};

Press pressed(std::string_view law, double mass_kg) {
  const HandRigSettings settings = pressing(law, mass_kg);
  const haptics::CouplingParameters& c = settings.coupling;
  HandRig rig(settings, press());
  Press result;
  for (int i = 0; i < 3000; ++i) {
    const HandRigTick tick = rig.tick();
    // Force before saturation. The spring-damper law uses the handle at the tick and the tool at the end of the step.
    const Vec3 requested =
        c.stiffness_n_per_m * (tick.X_WH.p - tick.X_WT.p) + c.damping_n_s_per_m * (tick.V_WH.v - tick.V_WT.v);
    result.at_s.push_back(to_seconds(tick.at));
    result.requested_n.push_back(requested.norm());
    result.shown_n.push_back(tick.on_hand_W.f.norm());
    result.largest_n = std::max({result.largest_n, tick.on_hand_W.f.norm(), tick.on_tool_W.f.norm()});
    result.largest_unequal_n = std::max(result.largest_unequal_n, (tick.on_hand_W.f + tick.on_tool_W.f).norm());
  }
  return result;
}

/// Returns the largest change that saturation makes to a force below the knee, over the presses of the spring-damper
/// with all masses.
double changed_below_knee_n(const std::vector<Press>& presses) {
  double changed = 0;
  for (const Press& press : presses) {
    for (std::size_t i = 0; i < press.requested_n.size(); ++i) {
      if (press.requested_n[i] <= kKnee_n)
        changed = std::max(changed, std::abs(press.shown_n[i] - press.requested_n[i]));
    }
  }
  return changed;
}

/// Returns the jump of the saturation curve's slope at the knee. Both slopes are computed by finite differences, just
/// below and just above the knee.
double slope_jump() {
  constexpr double kStep_n = 1e-6;
  const auto H = [](double force_n) { return haptics::saturated(force_n, kForceLimit_n, kSoftness); };
  const double below = (H(kKnee_n) - H(kKnee_n - kStep_n)) / kStep_n;
  const double above = (H(kKnee_n + kStep_n) - H(kKnee_n)) / kStep_n;
  return std::abs(above - below);
}

Plot curve_figure() {
  Plot figure;
  figure.caption = "Force shown against requested force, and its slope times 6.5";
  figure.description = figure.caption;
  figure.x = {.quantity = "requested force", .unit = "N"};
  figure.y = {.quantity = "shown force", .unit = "N"};
  figure.limits = {{kForceLimit_n, "F_max"}, {kKnee_n, "knee"}};
  Series curve{"force", {}, {}, 0}, slope{"slope × 6.5 N", {}, {}, 1};
  for (double force_n = 0; force_n <= 14; force_n += 0.05) {
    curve.x.push_back(force_n);
    curve.y.push_back(haptics::saturated(force_n, kForceLimit_n, kSoftness));
    slope.x.push_back(force_n);
    slope.y.push_back(kForceLimit_n * haptics::saturation_slope(force_n, kForceLimit_n, kSoftness));
  }
  figure.series = {curve, slope};
  return figure;
}

Plot press_figure(const std::vector<Press>& presses) {
  Plot figure;
  figure.caption = "A hand presses 70 mm into a plane and comes back: force on the hand, spring-damper, four masses";
  figure.description = figure.caption;
  figure.x = {.quantity = "time", .unit = "s"};
  figure.y = {.quantity = "force", .unit = "N"};
  figure.limits = {{kForceLimit_n, "F_max"}, {kKnee_n, "knee"}};
  for (std::size_t i = 0; i < presses.size(); ++i) {
    figure.series.push_back(
        {format_fixed(kSaturatingMasses_kg[i], 2) + " kg", presses[i].at_s, presses[i].shown_n, static_cast<int>(i)});
  }
  figure.series.push_back({"requested, 0.05 kg", presses.front().at_s, presses.front().requested_n, 4});
  return figure;
}

}  // namespace

Reproduction reproduce_saturation(const Clock&) {
  Reproduction result;
  result.title = "Force saturation of the coupling";
  result.summary =
      "A hand of 200 N/m presses 70 mm into a plane and comes back, k_t 300 N/m, damping 3 N·s/m, F_max 6.5 N, "
      "softness 0.2, for every law and mass. Saturation is part of the coupling: hand and tool get the same force. "
      "Identity and limit are read from the simulated forces, the slope at the knee from the curve.";
  std::vector<Press> linear;
  double largest_n = 0, unequal_n = 0, requested_n = 0;
  boost::json::object details;
  details["settings"] = {{"force_limit_n", kForceLimit_n},
                         {"softness", kSoftness},
                         {"stiffness_n_per_m", kCouplingStiffness_n_per_m},
                         {"damping_n_s_per_m", kCouplingDamping_n_s_per_m},
                         {"press_depth_m", kPressDepth_m},
                         {"hand_n_per_m", devices::HandParameters{}.stiffness_n_per_m},
                         {"mass_kg", boost::json::value_from(std::vector<double>(kSaturatingMasses_kg.begin(),
                                                                                 kSaturatingMasses_kg.end()))}};
  for (const haptics::CouplingLawInfo& info : haptics::coupling_laws()) {
    const std::string law(info.name);
    boost::json::array of_masses;
    for (const double mass_kg : kSaturatingMasses_kg) {
      const Press press = pressed(law, mass_kg);
      largest_n = std::max(largest_n, press.largest_n);
      unequal_n = std::max(unequal_n, press.largest_unequal_n);
      of_masses.push_back(press.largest_n);
      if (law != "spring-damper") continue;
      requested_n = std::max(requested_n, *std::ranges::max_element(press.requested_n));
      linear.push_back(press);
    }
    details[law] = {{"largest_force_n", of_masses}};
  }
  result.rows = {{"force from which it bends", "5.2 N", format_fixed(kKnee_n, 1) + " N"},
                 {"largest force, all laws and masses", "below 6.5 N", format_fixed(largest_n, 3) + " N"},
                 {"largest requested force, spring-damper", "", format_fixed(requested_n, 2) + " N"}};
  const std::string all = "all laws, 0.05 to 0.2 kg";
  result.claims = {{"spring-damper", "force below 5.2 N is changed by", changed_below_knee_n(linear), Relation::kAtMost,
                    1e-9, "N", 12},
                   {"spring-damper", "requested force in the press exceeds the limit", requested_n, Relation::kAtLeast,
                    kForceLimit_n, "N", 2},
                   {"curve", "slope jumps at the knee by", slope_jump(), Relation::kAtMost, 1e-5, "", 7},
                   {all, "largest force", largest_n, Relation::kAtMost, kForceLimit_n, "N", 4},
                   {all, "force on hand and force on tool differ by", unequal_n, Relation::kAtMost, 1e-9, "N", 12}};
  result.figures = {curve_figure(), press_figure(linear)};
  result.details = std::move(details);
  return result;
}

}  // namespace tandem::lab
