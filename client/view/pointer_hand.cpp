#include "client/view/pointer_hand.hpp"

namespace tandem::client {

void PointerHand::shift(const Vec3& by_W) {
  target_.X_DH.p += workspace_.X_WD.q.conjugate() * by_W / workspace_.position_scale;
}

void PointerHand::move(const Camera& camera, double right, double down) {
  shift(camera.height_at_m(X_WH().p) * (right * camera.right_W() - down * camera.up_W()));
}

void PointerHand::move_away(const Camera& camera, double share) {
  shift(camera.height_at_m(X_WH().p) * share * camera.forward_W());
}

void PointerHand::turn(const Camera& camera, double right_rad, double down_rad, double roll_rad) {
  const Vec3 turn_W = right_rad * camera.up_W() + down_rad * camera.right_W() + roll_rad * camera.forward_W();
  const Quat turn_D(workspace_.X_WD.q.conjugate() * quaternion_of(turn_W) * workspace_.X_WD.q);
  target_.X_DH.q = (turn_D * target_.X_DH.q).normalized();
}

void PointerHand::press(std::uint32_t button, bool is_down) {
  target_.buttons = is_down ? target_.buttons | button : target_.buttons & ~button;
}

void PointerHand::stay_near(const Pose& X_DH) {
  target_.X_DH.p = X_DH.p + clamped_to_length(target_.X_DH.p - X_DH.p, kMaxStretch_m);
  const Vec3 turn = rotation_vector(target_.X_DH.q * X_DH.q.conjugate());
  target_.X_DH.q = (quaternion_of(clamped_to_length(turn, kMaxTwist_rad)) * X_DH.q).normalized();
}

}  // namespace tandem::client
