#include "common/physics/joints/delayed_joint.hpp"

#include <algorithm>

namespace tandem::physics {
namespace {

/// Beside a damper, over a delay.
double stiffness_n_per_m(double damping_n_s_per_m, double share, Duration loop) {
  const double one_way_s = std::max(1e-3, to_seconds(loop) / 2);
  return std::min(DelayedJoint::kMaxStiffness_n_per_m, share * damping_n_s_per_m / one_way_s);
}

}  // namespace

Joint DelayedJoint::joint(Duration loop, Duration slowest_loop, const Vec3& pressing_W) noexcept {
  constexpr double kLeverSquare = kLever_m * kLever_m;
  Joint joint;
  joint.stiffness_n_per_m =
      stiffness_n_per_m(kAcrossDamping_n_s_per_m, kAcrossStiffnessShare, std::max(loop, slowest_loop));
  joint.damping_n_s_per_m = kAcrossDamping_n_s_per_m;
  joint.stiffness_n_m_per_rad = joint.stiffness_n_per_m * kLeverSquare;
  joint.damping_n_m_s_per_rad = joint.damping_n_s_per_m * kLeverSquare;
  joint.axis_W = pressing_W;
  joint.axis_stiffness_n_per_m = stiffness_n_per_m(kAlongDamping_n_s_per_m, kAlongStiffnessShare, loop);
  joint.axis_damping_n_s_per_m = kAlongDamping_n_s_per_m;
  return joint;
}

void DelayedJoint::step(Duration now, Duration period, const Use& use, Duration weight_wait) noexcept {
  const double period_s = to_seconds(period);
  // In whole steps.
  if (use.is_shared) shared_until_ = now + shared_kept_ / period * period;
  const bool is_shared = use.is_shared || now < shared_until_;
  const double change = is_shared ? period_s / kRise_s : -period_s / kFall_s;
  ramp_ = std::clamp(ramp_ + change, 0.0, 1.0);
  step_weight(now, period_s, use, weight_wait);
}

void DelayedJoint::step_weight(Duration now, double period_s, const Use& use, Duration wait) noexcept {
  const double goal = use.is_held && use.other_holders == 0 ? 1.0 : 0.0;
  if (!use.is_held) weight_ = 0;
  if (goal != weight_goal_) weight_goal_since_ = now;
  weight_goal_ = goal;
  if (now - weight_goal_since_ < wait) return;
  weight_ += std::clamp(goal - weight_, -period_s / kWeightTurn_s, period_s / kWeightTurn_s);
}

void DelayedJoint::disengage() noexcept {
  ramp_ = 0;
  shared_until_ = Duration{0};
}

}  // namespace tandem::physics
