#include "server/goals/conditions.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::server {
namespace {

bool exists(const BodyStates& bodies, std::size_t body) noexcept {
  return body < bodies.states.size() && (bodies.absent >> body & 1U) == 0;
}

bool exists(const BodyStates& bodies, const std::optional<std::size_t>& body) noexcept {
  return !body || exists(bodies, *body);
}

Pose frame(const BodyStates& bodies, const std::optional<std::size_t>& body) noexcept {
  return body ? bodies.states[*body].X : Pose{};
}

bool holds_now(const InRegionCondition& condition, const BodyStates& bodies) noexcept {
  if (!exists(bodies, condition.body) || !exists(bodies, condition.region.body)) return false;
  const Pose X_WR = frame(bodies, condition.region.body) * condition.region.X_FR;
  const Pose X_RB = X_WR.inverse() * bodies.states[condition.body].X;
  return std::ranges::all_of(
      condition.balls, [&](const BodyBall& ball) { return condition.region.contains(X_RB * ball.p_B, ball.radius_m); });
}

bool holds_now(const AtPoseCondition& condition, const BodyStates& bodies) noexcept {
  if (!exists(bodies, condition.body) || !exists(bodies, condition.beside)) return false;
  const Pose X_WT = frame(bodies, condition.beside) * condition.X_FT;
  const Pose& X_WB = bodies.states[condition.body].X;
  const double turn_rad = rotation_vector(X_WB.q * X_WT.q.conjugate()).norm();
  return (X_WB.p - X_WT.p).norm() <= condition.position_m && turn_rad <= condition.angle_rad;
}

bool holds_now(const HeldCondition& condition, const BodyStates& bodies) noexcept {
  return exists(bodies, condition.body) && bodies.holders[condition.body] >= condition.hands;
}

bool holds_now(const SlowerCondition& condition, const BodyStates& bodies) noexcept {
  if (!exists(bodies, condition.body)) return false;
  const Twist& V = bodies.states[condition.body].V;
  return V.v.norm() < condition.speed_m_per_s && V.w.norm() < condition.turn_rad_per_s;
}

bool holds_now(const SilhouetteCondition& condition, const BodyStates& bodies) noexcept {
  return (bodies.covered >> condition.fit & 1U) != 0;
}

bool holds_now(const SignalCondition& condition, const BodyStates& bodies) noexcept {
  const SignalStatus& signal = bodies.signals[condition.signal];
  return signal.is_fresh && condition.range.contains(signal.value);
}

}  // namespace

bool GoalRegion::contains(const Vec3& p_R, double radius_m) const noexcept {
  switch (kind) {
    case Kind::kSphere:
      return p_R.norm() + radius_m <= half_m.x();
    case Kind::kBox:
      return (p_R.array().abs() + radius_m <= half_m.array()).all();
    case Kind::kCylinder:
      return p_R.head<2>().norm() + radius_m <= half_m.x() && std::abs(p_R.z()) + radius_m <= half_m.z();
  }
  return false;
}

bool holds(const GoalCondition& condition, const BodyStates& bodies) noexcept {
  return std::visit([&bodies](const auto& kind) { return holds_now(kind, bodies); }, condition);
}

}  // namespace tandem::server
