#include "devices/mouse/mouse_device.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace tandem::devices {
namespace {

/// Maximum time that one read() simulates, which limits the cost of the call. After a longer pause, the rest is
/// skipped.
constexpr Duration kMaxFrame = std::chrono::milliseconds(100);

bool is_usable(const PointerTarget& target) {
  return is_finite(target.X_DH) && std::abs(target.X_DH.q.norm() - 1) < 1e-3;
}

}  // namespace

MouseDevice::MouseDevice(DeviceSpec spec, const HandParameters& hand, std::shared_ptr<Pointer> pointer,
                         std::unique_ptr<Rumble> rumble)
    : spec_(std::move(spec)), pointer_(std::move(pointer)), rumble_(std::move(rumble)), hand_(hand, Pose{}) {
  spec_.position_step_m = 0;
  spec_.rotation_step_rad = 0;
  if (pointer_ == nullptr) {
    throw std::invalid_argument(
        "the device mouse needs the window or --commands: leave out --headless, or use --device sim");
  }
}

HandParameters MouseDevice::default_hand() {
  HandParameters hand;
  hand.damping_n_s_per_m = 12.4;
  hand.damping_n_m_s_per_rad = 0.029;
  return hand;
}

DeviceSample MouseDevice::read(LocalTime now) noexcept {
  if (!std::exchange(has_started_, true)) last_read_ = now;
  if (pointer_->poll() && is_usable(pointer_->front())) {
    target_ = pointer_->front();
    target_.X_DH.p = clamped_to_length(target_.X_DH.p, kReach_m);
    target_.X_DH.q.normalize();
  }
  const Duration span = std::clamp(now - last_read_, Duration{0}, kMaxFrame);
  const auto steps = static_cast<int>(std::ceil(to_seconds(span) / HandDynamics::kMaxStep_s - 1e-9));
  for (int i = 0; i < steps; ++i) advance(to_seconds(span) / steps);
  last_read_ = std::max(last_read_, now);
  DeviceSample sample;
  sample.taken = now;
  sample.state = DeviceState::kReady;
  sample.is_valid = true;
  sample.X_DH = hand_.pose();
  sample.V_DH = hand_.twist();
  sample.buttons = target_.buttons;
  return sample;
}

void MouseDevice::advance(double dt_s) noexcept {
  constexpr double kOmega = kSmoothing_rad_per_s;
  Twist& rate = intended_rate_;
  const Vec3 turn = rotation_vector(target_.X_DH.q * intended_.q.conjugate());
  rate.v += dt_s * (kOmega * kOmega * (target_.X_DH.p - intended_.p) - 2 * kOmega * rate.v);
  rate.w += dt_s * (kOmega * kOmega * turn - 2 * kOmega * rate.w);
  rate = {clamped_to_length(rate.v, kMaxSpeed_m_per_s), clamped_to_length(rate.w, kMaxTurn_rad_per_s)};
  intended_ = integrate(intended_, rate, dt_s);
  hand_.advance(intended_, rate, on_hand_D_, Vec3::Zero(), dt_s);
}

bool MouseDevice::write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept {
  // Simulates the hand up to `now` under the previous force. The result is then independent of the order of read() and
  // write() within a tick.
  if (has_started_ && now > last_read_) read(now);
  if (!is_finite(wrench_on_hand_D)) return false;
  on_hand_D_ = wrench_on_hand_D;
  if (rumble_) rumble_->show(wrench_on_hand_D.f.norm() / spec_.force_limit_n);
  return true;
}

}  // namespace tandem::devices
