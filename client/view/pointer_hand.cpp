#include "client/view/pointer_hand.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/buttons.hpp"

namespace tandem::client {
namespace {

/// Sine of the camera's elevation above which the camera counts as looking from above.
constexpr double kAbove = 0.85;
/// Lower limit of the ratio of an axis's visible length in the picture to its true length. It limits the speed of the
/// hand along an axis that is nearly parallel to the line of sight.
constexpr double kMinSeen = 0.35;

bool is_from_above(const Camera& camera) {
  return std::abs(camera.forward_W().z()) > kAbove;
}

/// Returns the horizontal direction away from the camera.
Vec3 level_forward(const Camera& camera) {
  return Vec3::UnitZ().cross(camera.right_W());
}

}  // namespace

void PointerHand::move(const Camera& camera, double right, double down) {
  move_along(camera, right, down, is_from_above(camera) ? level_forward(camera) : Vec3(Vec3::UnitZ()));
}

void PointerHand::move_level(const Camera& camera, double right, double down) {
  move_along(camera, right, down, is_from_above(camera) ? Vec3(Vec3::UnitZ()) : level_forward(camera));
}

void PointerHand::move_along(const Camera& camera, double right, double down, const Vec3& axis_W) {
  const double seen = axis_W.dot(camera.up_W());
  const double steep = std::copysign(std::max(std::abs(seen), kMinSeen), seen);
  const Vec3 by_W = camera.height_at_m(X_WH().p) * (right * camera.right_W() - down / steep * axis_W);
  target_.X_DH.p += workspace_.X_WD.q.conjugate() * by_W / workspace_.position_scale;
}

void PointerHand::turn(const Camera& camera, double right_rad, double down_rad, double roll_rad) {
  const Vec3 turn_W = right_rad * camera.up_W() + down_rad * camera.right_W() + roll_rad * camera.forward_W();
  const Quat turn_D(workspace_.X_WD.q.conjugate() * quaternion_of(turn_W) * workspace_.X_WD.q);
  target_.X_DH.q = (turn_D * target_.X_DH.q).normalized();
}

void PointerHand::press(std::uint32_t button, bool is_down) {
  target_.buttons = is_down ? target_.buttons | button : target_.buttons & ~button;
}

// If the hand holds a body although the button is not pressed, the scene has attached the body at the start. To release
// it, the button is pressed now, and released after kPress.
void PointerHand::toggle_grab(bool is_holding, LocalTime now) {
  const bool is_down = (target_.buttons & kButtonGrab) != 0;
  missed_at_.reset();
  is_releasing_ = is_holding && !is_down;
  press(kButtonGrab, !is_down);
  grabbed_at_ = now;
}

void PointerHand::follow_grab(bool is_holding, LocalTime now) {
  if (is_releasing_) {
    if (now - grabbed_at_ < kPress) return;
    is_releasing_ = false;
    return press(kButtonGrab, false);
  }
  const bool is_down = (target_.buttons & kButtonGrab) != 0;
  if (!is_down || is_holding || now - grabbed_at_ < kGrabPatience) return;
  press(kButtonGrab, false);
  missed_at_ = now;
}

void PointerHand::stay_near(const Pose& X_DH) {
  target_.X_DH.p = X_DH.p + clamped_to_length(target_.X_DH.p - X_DH.p, kMaxStretch_m);
  const Vec3 turn = rotation_vector(target_.X_DH.q * X_DH.q.conjugate());
  target_.X_DH.q = (quaternion_of(clamped_to_length(turn, kMaxTwist_rad)) * X_DH.q).normalized();
}

}  // namespace tandem::client
