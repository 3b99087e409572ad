// See scripted_hand.hpp.
#include "client/commands/scripted_hand.hpp"

#include <algorithm>
#include <utility>

namespace tandem::client {
namespace {

// Limit of the time step in follow(). If the main thread is delayed, the pointer moves only a short distance in the
// next step.
constexpr Duration kMaxFrame = std::chrono::milliseconds(100);

}  // namespace

Pose device_pose(const WorkspaceMapping& workspace, const Pose& X_WH) {
  const Quat q_DW = workspace.X_WD.q.conjugate();
  return {q_DW * (X_WH.p - workspace.X_WD.p) / workspace.position_scale, (q_DW * X_WH.q).normalized()};
}

ScriptedHand::ScriptedHand(std::shared_ptr<devices::Pointer> pointer) : pointer_(std::move(pointer)) {}

void ScriptedHand::move_to(const Pose& X_WH, LocalTime now) {
  goal_WH_ = X_WH;
  has_arrived_ = false;
  moved_ = now;
}

void ScriptedHand::press(std::uint32_t button, bool is_down) {
  target_.buttons = is_down ? target_.buttons | button : target_.buttons & ~button;
}

void ScriptedHand::follow(const View& view, LocalTime now) {
  const TickRecord& record = view.record;
  const Duration passed = std::clamp(now - std::exchange(followed_, now), Duration{0}, kMaxFrame);
  if (std::exchange(scene_, record.scene_generation) != record.scene_generation) {
    goal_WH_.reset();
    target_.buttons = 0;
  }
  if (goal_WH_) advance(device_pose(view.workspace, *goal_WH_), to_seconds(passed));
  if (record.sample.is_valid) {
    stay_near(record.sample.X_DH);
    const Twist& V = record.sample.V_DH;
    if (V.v.norm() > kRestSpeed_m_per_s || V.w.norm() > kRestTurn_rad_per_s) moved_ = now;
  }
  pointer_->publish(target_);
}

void ScriptedHand::advance(const Pose& goal_DH, double dt_s) {
  Pose& X = target_.X_DH;
  const Vec3 way = goal_DH.p - X.p;
  const Vec3 turn = rotation_vector(goal_DH.q * X.q.conjugate());
  const Vec3 step = clamped_to_length(way, kSpeed_m_per_s * dt_s);
  const Vec3 turn_step = clamped_to_length(turn, kTurn_rad_per_s * dt_s);
  has_arrived_ = step == way && turn_step == turn;
  X.p += step;
  X.q = (quaternion_of(turn_step) * X.q).normalized();
}

void ScriptedHand::stay_near(const Pose& X_DH) {
  Pose& X = target_.X_DH;
  const Vec3 stretch = X.p - X_DH.p;
  const Vec3 twist = rotation_vector(X.q * X_DH.q.conjugate());
  if (stretch.norm() > kMaxStretch_m || twist.norm() > kMaxTwist_rad) has_arrived_ = false;
  X.p = X_DH.p + clamped_to_length(stretch, kMaxStretch_m);
  X.q = (quaternion_of(clamped_to_length(twist, kMaxTwist_rad)) * X_DH.q).normalized();
}

bool ScriptedHand::is_at_rest(LocalTime now) const {
  return now - moved_ >= kRestFor;
}

}  // namespace tandem::client
