#include "client/haptics/hand_input.hpp"

#include <algorithm>

#include "common/base/buttons.hpp"

namespace tandem::client {
namespace {

// Smallest time difference in the computation of a speed from two samples. A device that updates at 1 kHz may be read
// twice in quick succession; with the true time between the reads, the handle would appear to jump.
constexpr double kMinSpeedGap_s = 0.001;

}  // namespace

HandInput::HandInput(devices::Device& device, bool has_border)
    : reader_(device),
      device_path_(device.spec().position_step_m, device.spec().rotation_step_rad),
      workspace_(device.spec(), has_border) {}

void HandInput::enter(const WorkspaceMapping& scene) noexcept {
  clutch_.reset();
  workspace_.enter(scene);
}

void HandInput::read(LocalTime now) noexcept {
  const devices::DeviceSample sample = reader_.read(now);
  speed_m_per_s_ = speed_to(sample);
  sample_ = sample;
}

// Returns the speed of the handle: the larger one of two values. The speed reported by the device may lag because of a
// filter. The speed between two samples detects a jump at once.
double HandInput::speed_to(const devices::DeviceSample& sample) const noexcept {
  if (!sample.is_valid) return 0;
  const double reported_m_per_s = sample.V_DH.v.norm();
  if (!sample_.is_valid) return reported_m_per_s;
  const double gap_s = std::max(kMinSpeedGap_s, to_seconds(sample.taken - sample_.taken));
  return std::max(reported_m_per_s, (sample.X_DH.p - sample_.X_DH.p).norm() / gap_s);
}

bool HandInput::is_clutched() const noexcept {
  return (sample_.buttons & kButtonClutch) != 0 || workspace_.is_changing();
}

bool HandInput::move(const HandConditions& conditions) noexcept {
  if (sample_.is_valid) {
    X_DH_path_ = device_path_.follow(sample_.X_DH, sample_.V_DH, conditions.period_s);
  } else {
    device_path_.lose_pose();
  }
  if (!conditions.has_scene || !sample_.is_valid) {
    workspace_.rest();
    return false;
  }
  const bool is_remapped = apply_requested_mapping(conditions.is_quiet);
  move_base(conditions);
  move_handle();
  return is_remapped;
}

// Applies a requested mapping, if possible. The clutch must be pressed, so that the tool is frozen, and no force may be
// displayed.
bool HandInput::apply_requested_mapping(bool is_quiet) noexcept {
  if (!workspace_.is_changing() || !is_quiet || !clutch_.is_pressed()) return false;
  workspace_.apply_change();
  return true;
}

// Moves the device's base through the scene by rate control, unless the clutch is pressed or no force may be displayed.
void HandInput::move_base(const HandConditions& conditions) noexcept {
  if (!conditions.is_displaying || is_clutched()) return workspace_.rest();
  workspace_.advance(sample_.X_DH.p, conditions.scene_on_hand_D, conditions.period_s);
}

void HandInput::move_handle() noexcept {
  const WorkspaceMapping& map = workspace_.mapping();
  RigidState raw_W{map.world_pose(sample_.X_DH), map.world_twist(sample_.V_DH)};
  raw_W.V.v += workspace_.rate_W();
  raw_X_WH_ = map.world_pose(X_DH_path_);
  handle_W_ = clutch_.apply(raw_W, is_clutched());
  X_WH_path_ = handle_W_.X;
  if (is_clutched()) return;
  X_WH_path_.p += raw_X_WH_.p - raw_W.X.p;
  X_WH_path_.q = (raw_X_WH_.q * raw_W.X.q.conjugate() * X_WH_path_.q).normalized();
}

}  // namespace tandem::client
