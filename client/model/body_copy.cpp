#include "client/model/body_copy.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tandem::client {
namespace {

/// Time for which a body remains implicit (stepped by the model) after a touch by any tool. Without this time, two
/// quick taps would switch the body to followed (set to the server's states) and back.
constexpr double kTouchKept_s = 0.05;
/// Additional time for which a body remains implicit after the last touch by this user's tool; it is added to the loop
/// delay. After this time, server states that include the effect of the touch have arrived.
constexpr double kImplicitAfterTouch_s = 0.25;
/// Time constant with which the offset from the server's pose fades after a body has begun to follow the server's
/// states.
constexpr double kFollowTime_s = 0.08;

Shift faded(const Shift& shift, double period_s) {
  return shift * std::exp(-period_s / kFollowTime_s);
}

RigidState shifted(const RigidState& state, const Shift& shift) {
  return {{state.X.p + shift.p, (quaternion_of(shift.theta) * state.X.q).normalized()}, state.V};
}

}  // namespace

double BodyCopy::touched_error_m() const {
  return !is_followed_ && untouched_s_ < kTouchKept_s ? reconciler_.error_m() : 0;
}

void BodyCopy::forget(physics::World& world) noexcept {
  world.remove_body(id_);
  track_.reset();
  reconciler_.reset();
  offset_ = {};
  is_known_ = is_followed_ = false;
}

void BodyCopy::receive(Duration stepped, const RigidState& received, const BodyThen* then,
                       physics::World& world) noexcept {
  if (!std::exchange(is_known_, true)) world.set_body(id_, received);
  track_.add(stepped, received);
  if (then != nullptr && then->is_implicit) reconciler_.observe(received, then->state, then->given);
}

void BodyCopy::follow_touches(const ModelStep& step) noexcept {
  const std::uint32_t hands = step.world.hands_on(id_);
  untouched_s_ = (hands >> step.tool & 1U) != 0 ? 0 : untouched_s_ + step.period_s;
  unpressed_s_ = hands != 0 ? 0 : unpressed_s_ + step.period_s;
}

bool BodyCopy::is_implicit(Duration loop_delay) const noexcept {
  return unpressed_s_ < kTouchKept_s || untouched_s_ < kImplicitAfterTouch_s + to_seconds(loop_delay);
}

void BodyCopy::move(const ModelStep& step, bool is_partners) noexcept {
  if (!is_known_) return;
  if (is_implicit(step.loop_delay)) {
    reconcile(step, is_partners);
  } else {
    follow(step);
  }
}

void BodyCopy::reconcile(const ModelStep& step, bool is_partners) noexcept {
  is_followed_ = false;
  step.world.keep_implicit(id_, 2 * step.period_s);
  if (is_partners) return;
  const Shift shift = reconciler_.step(step.period_s, to_seconds(step.loop_delay));
  step.world.shift_body(id_, pose_of(shift), {shift.v, shift.w});
}

RigidState BodyCopy::seen_at_present(const ModelStep& step) const noexcept {
  RigidState target = track_.at(step.played);
  const Duration ahead = std::clamp(step.present - step.played, Duration{0}, step.longest_extrapolation);
  const double speed = target.V.v.norm();
  double ahead_s = to_seconds(ahead);
  if (speed * ahead_s > step.farthest_extrapolation_m) ahead_s = step.farthest_extrapolation_m / speed;
  target.X = integrate(target.X, target.V, ahead_s);
  return target;
}

void BodyCopy::follow(const ModelStep& step) noexcept {
  const RigidState target = seen_at_present(step);
  if (!is_followed_) {
    offset_ = shift_between(target, step.world.body(id_));
    reconciler_.reset();
    step.world.keep_implicit(id_, 0);
    is_followed_ = true;
  }
  offset_ = faded(offset_, step.period_s);
  step.world.set_body(id_, shifted(target, offset_));
}

void BodyCopy::restart(physics::World& world) noexcept {
  if (is_followed_ || !is_known_) return;
  world.set_body(id_, track_.newest());
  reconciler_.reset();
}

}  // namespace tandem::client
