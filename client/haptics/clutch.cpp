#include "client/haptics/clutch.hpp"

namespace tandem::client {

RigidState Clutch::apply(const RigidState& raw_W, bool is_pressed) noexcept {
  if (is_pressed) {
    if (!was_pressed_) frozen_ = clutched(raw_W.X);
    was_pressed_ = true;
    return {frozen_, Twist{}};
  }
  if (was_pressed_) {
    offset_p_ = frozen_.p - raw_W.X.p;
    offset_q_ = (raw_W.X.q.conjugate() * frozen_.q).normalized();
    was_pressed_ = false;
  }
  return {clutched(raw_W.X), raw_W.V};
}

void Clutch::reset() noexcept {
  *this = Clutch{};
}

Pose Clutch::clutched(const Pose& raw) const noexcept {
  return {raw.p + offset_p_, (raw.q * offset_q_).normalized()};
}

}  // namespace tandem::client
