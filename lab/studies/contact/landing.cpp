#include "lab/studies/contact/landing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "lab/report/format.hpp"
#include "lab/studies/contact/touch_path.hpp"

namespace tandem::lab {
namespace {

constexpr std::array kSpeeds_m_per_s{0.022, 0.06, 0.3};
constexpr std::array kStiffnesses_n_per_m{300.0, 2000.0};
constexpr double kGap_m = 0.005;
constexpr double kPress_n = 3;
constexpr double kStop_s = 0.01;
constexpr double kHold_s = 0.3;
constexpr double kNoLimit = 1e6;  // force limit [N] and torque limit [N·m] that are never reached
constexpr double kGravity_m_per_s2 = 9.81;
constexpr double kGroundRadii = 40;
constexpr double kGroundThickness_m = 0.05;
constexpr int kWays = 64;
constexpr double kFlat_m = 1e-5;
constexpr double kStandingTilt = 0.1;
constexpr double kRest_m_per_s = 1e-3;
constexpr double kMaxRatio = 1.1;
constexpr double kMaxSeparations = 1;
constexpr double kMaxCreated_j = 1e-3;

/// A straight motion at constant speed, followed by deceleration to rest within kStop_s.
struct StraightHand {
  RigidState start;
  double cruise_s = 0;

  double end_s() const { return cruise_s + kStop_s; }
  RigidState operator()(Duration at) const {
    const double t = to_seconds(at), slowing_s = std::clamp(t - cruise_s, 0.0, kStop_s);
    const double share_left = 1 - slowing_s / kStop_s;
    RigidState now = start;
    now.X.p += start.V.v * (std::min(t, cruise_s) + slowing_s * (1 + share_left) / 2);
    now.V.v *= share_left;
    return now;
  }
};

TouchSettings settings_of(double mass_kg, double stiffness_n_per_m) {
  TouchSettings settings;
  settings.mass_kg = mass_kg;
  settings.coupling.stiffness_n_per_m = stiffness_n_per_m;
  settings.coupling.force_limit_n = settings.coupling.torque_limit_n_m = kNoLimit;
  return settings;
}

Landing land(const TouchObject& tool, const TouchObject& fixed, const RigidState& start, const TouchSettings& settings,
             const Clock& clock) {
  Landing landing;
  const double v = landing.speed_m_per_s = start.V.v.norm();
  const double k = landing.stiffness_n_per_m = settings.coupling.stiffness_n_per_m;
  landing.name = "landing at " + format_significant(1e3 * v, 3) + " mm/s, " + format_significant(k, 4) + " N/m";
  const Vec3 inertia = box_inertia_kg_m2(tool.shape->high_S - tool.shape->low_S, settings.mass_kg);
  const haptics::CouplingParameters coupling = damped_for(settings.coupling, settings.mass_kg, inertia);
  const double gyration_m = std::sqrt(inertia.minCoeff() / settings.mass_kg);
  landing.stop_force_n = v * (coupling.damping_n_s_per_m + k * settings.step_s);
  landing.stop_torque_n_m =
      v / (2 * gyration_m) * (coupling.damping_n_m_s_per_rad + coupling.stiffness_n_m_per_rad * settings.step_s);

  const StraightHand hand{start, (kGap_m + kPress_n / k) / v};
  const TouchTrace trace =
      run_touch(*tool.shape, *fixed.shape, hand, from_seconds(hand.end_s() + kHold_s), settings, clock);
  landing.figures = quick_figures_of({trace});
  landing.kinetic_left_j = trace.back().kinetic_j;
  return landing;
}

/// Returns the time after which the tool stays slower than kRest_m_per_s. Its speed is computed from its kinetic
/// energy.
double rest_s(const TouchTrace& trace, double mass_kg) {
  const double rest_j = 0.5 * mass_kg * kRest_m_per_s * kRest_m_per_s;
  const auto last =
      std::find_if(trace.rbegin(), trace.rend(), [&](const TouchStep& step) { return step.kinetic_j > rest_j; });
  if (last == trace.rbegin()) return std::numeric_limits<double>::infinity();
  return last == trace.rend() ? 0 : to_seconds(last->at);
}

/// Returns whether the tool stands stably on this side of its bounding box; see drops().
bool is_face(const ExactSurface& tool, int axis, double sign) {
  const auto reach_of = [&](const ExactSurface& part, const Vec3& corner) {
    return sign * corner[axis] + part.half_thickness_m();
  };
  double reach_m = 0;
  for (const ExactSurface* part : tool.parts()) {
    for (const Vec3& corner : part->corners()) reach_m = std::max(reach_m, reach_of(*part, corner));
  }
  std::vector<Vec3> base;
  for (const ExactSurface* part : tool.parts()) {
    for (const Vec3& corner : part->corners()) {
      if (reach_of(*part, corner) >= reach_m - kFlat_m) base.push_back(corner);
    }
  }
  // The tool stands stably if every horizontal direction has a supporting vertex far enough from the centre. "Far
  // enough" is kStandingTilt times the height of the centre above the side.
  for (int i = 0; i < kWays; ++i) {
    const double angle = 2 * std::numbers::pi * i / kWays;
    Vec3 way = Vec3::Zero();
    way[(axis + 1) % 3] = std::cos(angle);
    way[(axis + 2) % 3] = std::sin(angle);
    const auto holds = [&](const Vec3& corner) { return way.dot(corner) >= kStandingTilt * reach_m; };
    if (std::none_of(base.begin(), base.end(), holds)) return false;
  }
  return true;
}

Landing drop(const contact::ContactShape& tool, const contact::ContactShape& ground, int axis, double sign,
             const TouchSettings& settings, const Clock& clock) {
  RigidState start;
  start.X.q = Quat::FromTwoVectors(sign * Vec3::Unit(axis), -Vec3::UnitZ());
  start.X.p.z() = ground.high_S.z() + kGap_m + (sign > 0 ? tool.high_S[axis] : -tool.low_S[axis]);
  const auto nowhere = [&](Duration) { return start; };
  const TouchTrace trace = run_touch(tool, ground, nowhere, from_seconds(kDrop_s), settings, clock);
  Landing landing;
  landing.name = std::string("drop on ") + (sign > 0 ? "+" : "−") + "xyz"[axis];
  landing.figures = quick_figures_of({trace});
  landing.rest_s = rest_s(trace, settings.mass_kg);
  landing.kinetic_left_j = trace.back().kinetic_j;
  return landing;
}

double ratio_of(double value, double bound) {
  return bound > 0 ? value / bound : 0;
}

boost::json::object to_json(const Landing& landing) {
  const TouchFigures& figures = landing.figures;
  boost::json::object json{{"name", landing.name},
                           {"contacts_max", figures.contacts_max},
                           {"separations", figures.separations},
                           {"contact_created_j", figures.contact_created_j},
                           {"contact_returned_j", figures.contact_returned_j},
                           {"kinetic_left_j", landing.kinetic_left_j},
                           {"not_converged", figures.not_converged}};
  if (landing.speed_m_per_s <= 0) {
    json["is_on_face"] = landing.is_on_face;
    json["rest_s"] = std::isfinite(landing.rest_s) ? boost::json::value(landing.rest_s) : boost::json::value();
    return json;
  }
  json["speed_m_per_s"] = landing.speed_m_per_s;
  json["stiffness_n_per_m"] = landing.stiffness_n_per_m;
  json["hand_force_step_max_n"] = figures.hand_force_step_max_n;
  json["stop_force_n"] = landing.stop_force_n;
  json["force_ratio"] = ratio_of(figures.hand_force_step_max_n, landing.stop_force_n);
  json["hand_torque_step_max_n_m"] = figures.hand_torque_step_max_n_m;
  json["stop_torque_n_m"] = landing.stop_torque_n_m;
  json["torque_ratio"] = ratio_of(figures.hand_torque_step_max_n_m, landing.stop_torque_n_m);
  return json;
}

}  // namespace

std::vector<Landing> landings(const TouchObject& tool, const TouchObject& fixed, const Vec3& direction_W,
                              double mass_kg, const Clock& clock) {
  TouchPlan plan;
  plan.direction_W = direction_W;
  plan.approach_m = kGap_m;
  RigidState start;
  start.X = touch_path(*tool.exact, *fixed.exact, plan).pose_at(Duration{0});
  std::vector<Landing> all;
  for (const double stiffness : kStiffnesses_n_per_m) {
    for (const double speed : kSpeeds_m_per_s) {
      start.V.v = speed * direction_W.normalized();
      all.push_back(land(tool, fixed, start, settings_of(mass_kg, stiffness), clock));
    }
  }
  return all;
}

std::vector<Landing> drops(const TouchObject& tool, double mass_kg, const Clock& clock) {
  TouchSettings settings = settings_of(mass_kg, 0);
  settings.coupling.stiffness_n_m_per_rad = 0;
  settings.gravity_m_per_s2 = -kGravity_m_per_s2 * Vec3::UnitZ();
  const double width_m = kGroundRadii * tool.shape->radius_m();
  const auto ground = contact::make_contact_box({width_m, width_m, kGroundThickness_m});
  std::vector<Landing> all;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      all.push_back(drop(*tool.shape, *ground, axis, sign, settings, clock));
      all.back().is_on_face = is_face(*tool.exact, axis, sign);
    }
  }
  return all;
}

std::vector<Check> landing_checks(const std::vector<Landing>& all) {
  std::vector<Check> checks;
  for (const Landing& landing : all) {
    const TouchFigures& figures = landing.figures;
    checks.push_back(
        {landing.name, "contacts at most", static_cast<double>(figures.contacts_max), Relation::kAtLeast, 1, "", 0});
    if (landing.speed_m_per_s > 0) {
      checks.push_back({landing.name, "steps of the hand's force, over those of a rigid stop",
                        ratio_of(figures.hand_force_step_max_n, landing.stop_force_n), Relation::kAtMost, kMaxRatio, "",
                        2});
      checks.push_back({landing.name, "steps of the hand's torque, over those of a rigid stop",
                        ratio_of(figures.hand_torque_step_max_n_m, landing.stop_torque_n_m), Relation::kAtMost,
                        kMaxRatio, "", 2});
      checks.push_back({landing.name, "contact lost again", static_cast<double>(figures.separations), Relation::kAtMost,
                        kMaxSeparations, "", 0});
    } else if (landing.is_on_face) {
      checks.push_back({landing.name, "at rest after", landing.rest_s, Relation::kAtMost, kDrop_s, "s"});
    }
    checks.push_back({landing.name, "energy created by contact", 1e3 * figures.contact_created_j, Relation::kAtMost,
                      1e3 * kMaxCreated_j, "mJ", 3});
  }
  return checks;
}

boost::json::object to_json(const std::vector<Landing>& all) {
  boost::json::array landings, drops;
  for (const Landing& landing : all) (landing.speed_m_per_s > 0 ? landings : drops).push_back(to_json(landing));
  return {{"landings", landings}, {"drops", drops}, {"checks", to_json(landing_checks(all))}};
}

std::string to_text(const std::vector<Landing>& all) {
  std::ostringstream text;
  for (const Landing& landing : all) {
    const TouchFigures& figures = landing.figures;
    text << landing.name << "\n";
    if (landing.speed_m_per_s > 0) {
      text << "  hand's force step     " << format_significant(figures.hand_force_step_max_n, 3)
           << " N, of a rigid stop " << format_significant(landing.stop_force_n, 3) << " N\n  torque step           "
           << format_significant(1e3 * figures.hand_torque_step_max_n_m, 3) << " mN m, of a rigid stop "
           << format_significant(1e3 * landing.stop_torque_n_m, 3) << " mN m\n  contact lost again    "
           << figures.separations << " times\n";
    } else if (std::isfinite(landing.rest_s)) {
      text << "  at rest after         " << format_significant(landing.rest_s, 3) << " s\n";
    } else {
      text << "  still moves           " << format_significant(1e3 * landing.kinetic_left_j, 3) << " mJ left\n";
    }
    text << "  contact returned      " << format_significant(1e3 * figures.contact_returned_j, 3)
         << " mJ, created at most " << format_significant(1e3 * figures.contact_created_j, 3) << " mJ\n";
  }
  return text.str();
}

}  // namespace tandem::lab
