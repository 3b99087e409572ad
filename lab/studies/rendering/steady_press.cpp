#include "lab/studies/rendering/steady_press.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "lab/metrics/high_pass.hpp"
#include "lab/studies/rendering/law_curves.hpp"

namespace tandem::lab {
namespace {

constexpr double kReach_s = 1.0;

bool is_at_handle(std::string_view law) {
  return haptics::find_coupling_law(law)->tool == haptics::ToolDynamics::kAtHandle;
}

/// Returns a path that moves down to a target. At the target, the hand's spring, the coupling and the plane are in
/// equilibrium at `force_n`.
devices::HandPath reaching(double force_n, const HandRigSettings& rig) {
  const double contact_m = force_n / rig.contact_n_per_m;
  const double coupling_m = is_at_handle(rig.law) ? 0 : displacement_m(rig.law, rig.coupling, force_n);
  const double hand_m = force_n / rig.hand.stiffness_n_per_m;
  const Pose above{1e-3 * Vec3::UnitZ(), Quat::Identity()};
  const Pose pressing{-(contact_m + coupling_m + hand_m) * Vec3::UnitZ(), Quat::Identity()};
  return devices::HandPath({{Duration(0), above, 0, ""}, {from_seconds(kReach_s), pressing, 0, ""}});
}

haptics::CouplingParameters coupling_for(std::string_view law, const PressSettings& settings) {
  if (settings.coupling) return *settings.coupling;
  haptics::CouplingParameters coupling;
  coupling.force_limit_n = settings.force_limit_n;
  coupling.saturation_softness = kSoftness;
  coupling.damping_n_s_per_m = settings.damping_n_s_per_m;
  return is_at_handle(law) ? coupling : with_secant_stiffness(law, coupling, settings.secant_n_per_m, 1);
}

}  // namespace

HandRigSettings equal_rig(std::string_view law, const PressSettings& settings) {
  HandRigSettings rig;
  rig.law = law;
  rig.coupling = coupling_for(law, settings);
  rig.tool_mass_kg = settings.tool_mass_kg;
  rig.plane_z_m = 0;
  if (is_at_handle(law)) rig.contact_n_per_m = settings.secant_n_per_m;
  rig.hand.encoder_step_m = settings.encoder_step_m;
  rig.hand.tremor_rms_n = settings.tremor_rms_n;
  rig.seed = settings.seed;
  return rig;
}

double encoder_quantum_n(std::string_view law, double force_n, const PressSettings& settings) {
  const HandRigSettings rig = equal_rig(law, settings);
  const double by_velocity_n = rig.coupling.damping_n_s_per_m * settings.encoder_step_m * rig.rate_hz;
  if (is_at_handle(law)) return rig.contact_n_per_m * settings.encoder_step_m;
  const double d_m = displacement_m(law, rig.coupling, force_n);
  const auto model = haptics::make_coupling_law(law, rig.coupling);
  return elastic_force_n(*model, d_m + settings.encoder_step_m, true) - elastic_force_n(*model, d_m, true) +
         by_velocity_n;
}

SteadyPress press_steadily(std::string_view law, double force_n, const PressSettings& settings) {
  const HandRigSettings with = equal_rig(law, settings);
  HandRig rig(with, reaching(force_n, with));
  SteadyPress result;
  std::vector<double> contact_n;
  const auto settling = std::lround(settings.settling_s * with.rate_hz);
  const auto recorded = std::lround(settings.recorded_s * with.rate_hz);
  for (long i = 0; i < settling; ++i) rig.tick();
  for (long i = 0; i < recorded; ++i) {
    const HandRigTick tick = rig.tick();
    result.normal_n.push_back(tick.on_hand_W.f.z());
    contact_n.push_back(tick.normal_force_n);
  }
  result.mean_normal_n = std::accumulate(contact_n.begin(), contact_n.end(), 0.0) / static_cast<double>(recorded);
  const std::vector<double> high = high_passed(result.normal_n, with.rate_hz, kVibration_hz);
  // Excludes the first half second, which contains the transient of the filter.
  result.rms_n = rms(std::span(high).subspan(static_cast<std::size_t>(with.rate_hz / 2)));
  const auto [low, top] = std::ranges::minmax(result.normal_n);
  result.range_n = top - low;
  return result;
}

}  // namespace tandem::lab
