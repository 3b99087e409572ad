#include "lab/studies/rendering/coupling_trial.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/haptics/coupling/stability.hpp"
#include "lab/metrics/high_pass.hpp"
#include "lab/studies/conventions.hpp"
#include "lab/studies/rendering/hand_rig.hpp"

namespace tandem::lab {
namespace {

/// Forces with which a hand presses at the start and at the end of a trial, as fractions of the force limit.
constexpr double kLightPress = 0.1;
constexpr double kFirmPress = 0.3;
/// Largest rotation that a hand intends. It stays below half a turn (3.14 rad): if hand and tool differed by more, the
/// rotational spring would pull in the opposite direction.
constexpr double kFurthestTurn_rad = 1.5;
/// Inertia of the tool against which a hand twists. It is so large that the tool practically does not rotate during the
/// trial.
constexpr double kHeldFast_kg_m2 = 1e6;
/// Mass and inertia of the tool for the motion that is not tested (rotation or translation).
constexpr double kOtherMass_kg = 0.1;
constexpr double kOtherInertia_kg_m2 = 4e-5;
/// Depth by which the tool sinks when its weight is applied as a step.
constexpr double kSag_m = 1e-3;
constexpr double kNoLimit_n = 1e6;
constexpr Duration kReach = std::chrono::milliseconds(250);
constexpr Duration kRest = std::chrono::milliseconds(2000);
constexpr Duration kLastOfRest = std::chrono::milliseconds(250);
/// A motion counts as decaying if its range in the last interval is below this fraction of its range in the previous
/// interval.
constexpr double kShrinking = 0.9;
constexpr Duration kPress = std::chrono::milliseconds(2000);
constexpr Duration kSettled = std::chrono::milliseconds(800);
/// Hand that does not move noticeably under the forces of shipped devices. It is critically damped, and the simulation
/// of this stiff hand is stable with the time step of the trials.
constexpr devices::HandParameters kUnmovedHand{.mass_kg = 10,
                                               .stiffness_n_per_m = 1e7,
                                               .damping_n_s_per_m = 2e4,
                                               .inertia_kg_m2 = 1,
                                               .stiffness_n_m_per_rad = 1e6,
                                               .damping_n_m_s_per_rad = 2e3};

/// Range of the positions of the handle.
struct TrialRange {
  double low = INFINITY;
  double high = -INFINITY;
  void add(double at) {
    low = std::min(low, at);
    high = std::max(high, at);
  }
  double size() const { return high - low; }
};

Pose moved(bool is_rotation, double by) {
  if (is_rotation) return {Vec3::Zero(), quaternion_of(by * Vec3::UnitZ())};
  return {by * Vec3::UnitZ(), Quat::Identity()};
}

double along(bool is_rotation, const Pose& X) {
  return is_rotation ? rotation_vector(X.q).z() : X.p.z();
}

haptics::CouplingParameters with(const devices::DeviceProfile& profile, bool is_rotation, const Pair& pair) {
  haptics::CouplingParameters coupling;
  coupling.force_limit_n = profile.spec.force_limit_n;
  coupling.torque_limit_n_m = profile.spec.torque_limit_n_m;
  (is_rotation ? coupling.stiffness_n_m_per_rad : coupling.stiffness_n_per_m) = pair.stiffness;
  (is_rotation ? coupling.damping_n_m_s_per_rad : coupling.damping_n_s_per_m) = pair.damping;
  return coupling;
}

HandRigSettings rig_with(const devices::DeviceProfile& profile, bool is_rotation, const Pair& pair, double inertia,
                         const devices::HandParameters& hand, const CalibrationSettings& settings) {
  HandRigSettings rig;
  rig.law = "spring-damper";  // with fixed parameters, the adaptive law equals this law
  rig.coupling = with(profile, is_rotation, pair);
  rig.rate_hz = settings.rate_hz;
  rig.tool_mass_kg = is_rotation ? kOtherMass_kg : inertia;
  rig.tool_inertia_kg_m2 = Vec3::Constant(is_rotation ? inertia : kOtherInertia_kg_m2);
  rig.hand = hand;
  rig.seed = settings.seed;
  return rig;
}

/// Returns the position that a hand must intend in order to press with `force`. It is the sum of two deflections: of
/// the hand's own spring and of the coupling. For a soft rotational coupling the sum is limited to kFurthestTurn_rad,
/// so the torque is smaller than requested.
double wanted_for(double force, double hand_stiffness, double stiffness, bool is_rotation) {
  const double deflection = force * (1 / hand_stiffness + 1 / stiffness);
  return -(is_rotation ? std::min(deflection, kFurthestTurn_rad) : deflection);
}

void make_hard(HandRigSettings& rig, bool is_rotation) {
  if (is_rotation) {
    rig.tool_inertia_kg_m2 = Vec3::Constant(kHeldFast_kg_m2);
  } else {
    rig.plane_z_m = 0;
  }
}

}  // namespace

double CouplingTrial::spectral_radius(const Pair& pair, double inertia) const {
  haptics::LoopDevice device;
  device.mass_kg = profile_.apparent_mass_kg.value;
  device.damping_n_s_per_m = profile_.physical_damping_n_s_per_m.value;
  device.has_torque = is_rotation_;
  device.inertia_kg_m2 = profile_.apparent_inertia_kg_m2.value;
  device.damping_n_m_s_per_rad = profile_.physical_damping_n_m_s_per_rad.value;
  device.period_s = 1 / settings_.rate_hz;
  device.delay_periods = settings_.delay_margin_periods;
  const Pair stronger{settings_.gain_margin * pair.stiffness, settings_.gain_margin * pair.damping};
  double worst = 0;
  for (const haptics::CheckedLoop& loop :
       haptics::checked_loops(with(profile_, is_rotation_, stronger), inertia, inertia, device)) {
    if (loop.is_rotation != is_rotation_) continue;
    worst = std::max(worst, loop.spectral_radius);
  }
  return worst;
}

double CouplingTrial::restlessness(const Pair& pair, double inertia) const {
  double worst = 0;
  for (std::size_t i = 1; i < haptics::checked_hands().size(); ++i) {  // entry 0 stands for "no hand"
    worst = std::max(worst, restlessness_of(i, pair, inertia));
  }
  return worst;
}

double CouplingTrial::roughness(const Pair& pair, double inertia) const {
  double worst = 0;
  for (std::size_t i = 1; i < haptics::checked_hands().size(); ++i) {
    worst = std::max(worst, roughness_of(i, pair, inertia));
  }
  return worst;
}

devices::HandParameters CouplingTrial::hand(double tremor_rms_n, std::size_t of_checked) const {
  devices::HandParameters hand = hand_of(haptics::checked_hands()[of_checked]);
  hand.tremor_rms_n = tremor_rms_n;
  hand = devices::holding(hand, profile_);
  if (hand.encoder_step_m == 0) hand.encoder_step_m = settings_.nominal_step_m;
  if (hand.encoder_step_rad == 0) hand.encoder_step_rad = settings_.nominal_step_rad;
  return hand;
}

double CouplingTrial::restlessness_of(std::size_t of_checked, const Pair& pair, double inertia) const {
  const devices::HandParameters held = hand(0, of_checked);
  HandRigSettings rig = rig_with(profile_, is_rotation_, pair, inertia, held, settings_);
  make_hard(rig, is_rotation_);
  const double limit = is_rotation_ ? profile_.spec.torque_limit_n_m : profile_.spec.force_limit_n;
  const double hand_stiffness = is_rotation_ ? held.stiffness_n_m_per_rad : held.stiffness_n_per_m;
  const double wanted = wanted_for(kLightPress * limit, hand_stiffness, pair.stiffness, is_rotation_);
  HandRig loop(rig, devices::HandPath(
                        {{Duration(0), moved(is_rotation_, 0), 0, ""}, {kReach, moved(is_rotation_, wanted), 0, ""}}));
  TrialRange before, last;
  for (HandRigTick tick = loop.tick(); tick.at < kRest; tick = loop.tick()) {
    const double at = along(is_rotation_, tick.X_WH);
    if (tick.at >= kRest - kLastOfRest) {
      last.add(at);
    } else if (tick.at >= kRest - 2 * kLastOfRest) {
      before.add(at);
    }
  }
  if (last.size() < kShrinking * before.size()) return 0;  // decaying motion of a slow hand that still settles
  return last.size() / (is_rotation_ ? held.encoder_step_rad : held.encoder_step_m);
}

double CouplingTrial::roughness_of(std::size_t of_checked, const Pair& pair, double inertia) const {
  const devices::HandParameters held = hand(settings_.tremor_rms_n, of_checked);
  HandRigSettings rig = rig_with(profile_, is_rotation_, pair, inertia, held, settings_);
  make_hard(rig, is_rotation_);
  const double limit = is_rotation_ ? profile_.spec.torque_limit_n_m : profile_.spec.force_limit_n;
  const double hand_stiffness = is_rotation_ ? held.stiffness_n_m_per_rad : held.stiffness_n_per_m;
  const auto pressing = [&](double share) {
    return moved(is_rotation_, wanted_for(share * limit, hand_stiffness, pair.stiffness, is_rotation_));
  };
  HandRig loop(rig, devices::HandPath({{Duration(0), moved(is_rotation_, 0), 0, ""},
                                       {kReach, pressing(kLightPress), 0, ""},
                                       {kPress, pressing(kFirmPress), 0, ""}}));
  std::vector<double> forces;
  for (HandRigTick tick = loop.tick(); tick.at < kPress; tick = loop.tick()) {
    forces.push_back(is_rotation_ ? tick.on_hand_W.t.z() : tick.on_hand_W.f.z());
  }
  const std::vector<double> high = high_passed(forces, settings_.rate_hz, kVibration_hz);
  // Excludes the first 0.75 s of the force. They contain the motion to the wall and the transient of the filter.
  const auto settled = static_cast<std::size_t>(3 * to_seconds(kReach) * settings_.rate_hz);
  return rms(std::span(high).subspan(std::min(settled, high.size())));
}

// Rotation obeys the same equation as translation and is therefore simulated as a translation. No force saturates, and
// the hand does not yield.
double CouplingTrial::settling_cost(const Pair& pair, double inertia) const {
  HandRigSettings rig = rig_with(profile_, false, pair, inertia, kUnmovedHand, settings_);
  rig.coupling.force_limit_n = kNoLimit_n;
  rig.gravity_m_per_s2 = -kSag_m * pair.stiffness / inertia * Vec3::UnitZ();
  HandRig loop(rig, devices::HandPath({{Duration(0), Pose{}, 0, ""}}));
  double cost = 0;
  for (HandRigTick tick = loop.tick(); tick.at < kSettled; tick = loop.tick()) {
    const double from_rest = tick.X_WH.p.z() - tick.X_WT.p.z() - kSag_m;
    cost += to_seconds(tick.at) * std::abs(from_rest) / settings_.rate_hz;
  }
  return cost;
}

}  // namespace tandem::lab
