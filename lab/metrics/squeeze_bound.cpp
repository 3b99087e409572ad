#include "lab/metrics/squeeze_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "client/haptics/stages/stage.hpp"
#include "common/physics/joints/delayed_joint.hpp"
#include "lab/metrics/metrics.hpp"
#include "lab/metrics/touch_errors.hpp"

namespace tandem::lab {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// Displayed, in the settled hold.
Vec3 mean_force(const std::vector<const TickSample*>& ticks) {
  Vec3 sum = Vec3::Zero();
  for (const TickSample* tick : ticks) sum += tick->displayed_D.f;
  return sum / static_cast<double>(ticks.size());
}

bool holds_a_body(const std::vector<const TickSample*>& ticks) {
  return std::any_of(ticks.begin(), ticks.end(), [](const TickSample* tick) { return tick->held_body.is_valid(); });
}

double own_compliance_m_per_n(const UserTrace& user) {
  return 1 / user.user.hand_parameters.stiffness_n_per_m + 1 / user.coupling_stiffness_n_per_m;
}

double zero_delay_joint_n_per_m(const UserTrace& user) {
  if (!client::needs_local_model(user.user.pipeline.stage)) return std::numeric_limits<double>::infinity();
  return physics::DelayedJoint::joint(Duration{0}, Duration{0}, Vec3::UnitX()).axis_stiffness_n_per_m;
}

double passive_joint_n_per_m(const UserTrace& user) {
  const double rtt_ms = to_seconds(round_trip_of(user.user)) * 1e3;
  const double one_way_s = rtt_ms / 2000;
  return physics::DelayedJoint::kAlongDamping_n_s_per_m / one_way_s;
}

}  // namespace

double hold_force_bound_n(const TrialView& trial) {
  if (trial.reference == nullptr || trial.trace.users.size() != 2) return kNothing;
  std::vector<Vec3> forces;
  double own = 0, at_zero = 0, delayed = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const UserTrace& user = trial.trace.users[i];
    const UserTrace& reference = trial.reference->users[i];
    const auto ticks = settled_hold_ticks(reference);
    const bool is_in_world_scale = user.hand_joules_per_world_joule == 1;
    if (ticks.empty() || holds_a_body(ticks) || !is_in_world_scale ||
        !client::needs_local_model(user.user.pipeline.stage)) {
      return kNothing;
    }
    forces.push_back(mean_force(ticks));
    own += own_compliance_m_per_n(user);
    at_zero += 1 / zero_delay_joint_n_per_m(reference);
    delayed += 1 / passive_joint_n_per_m(user);
  }
  const Vec3 squeezing = (forces[0] - forces[1]) / 2, bearing = (forces[0] + forces[1]) / 2;
  if (!(squeezing.norm() >= kContactForce_n)) return kNothing;
  const double left = (own + at_zero) / (own + delayed);
  return std::min((bearing + left * squeezing).norm(), (bearing - left * squeezing).norm());
}

}  // namespace tandem::lab
