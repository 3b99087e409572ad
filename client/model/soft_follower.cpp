#include "client/model/soft_follower.hpp"

#include <algorithm>

namespace tandem::client {
namespace {

/// Decay time of the difference e between two received contacts: three steps of the soft bodies. Measured: with this
/// time, a resting hand vibrates at 0.15 mm/s; with a decay time of one step, at 1 to 2 mm/s.
constexpr double kSettling_s = 0.05;

bool is_same(const SoftContact& a, const SoftContact& b) {
  return a.trust_radius_m == b.trust_radius_m && a.wrench_W.f == b.wrench_W.f && a.wrench_W.t == b.wrench_W.t &&
         a.X_WT0.p == b.X_WT0.p;
}

}  // namespace

void SoftFollower::attach_to(BodyId held) noexcept {
  if (held == held_) return;
  *this = SoftFollower{};
  held_ = held;
}

void SoftFollower::receive(const SoftContact& received, const Pose& X_WT) noexcept {
  if (is_same(received, received_)) return;
  left_ += physics::soft_wrench(received_, X_WT) - physics::soft_wrench(received, X_WT);
  received_ = received;
}

Wrench SoftFollower::step(const Pose& X_WT, double period_s) noexcept {
  constexpr double kRate = 1 / kSettling_s;
  left_rate_ += (left_ * (-kRate * kRate) + left_rate_ * (-2 * kRate)) * period_s;
  left_ += left_rate_ * period_s;
  Wrench wrench = physics::soft_wrench(received_, X_WT) + left_;
  // The fading difference stems from the previous contact. The total force must not become attractive because of it.
  const double pressing = received_.wrench_W.f.norm();
  if (pressing > 0) {
    const Vec3 normal_W = received_.wrench_W.f / pressing;
    wrench.f -= normal_W * std::min(0.0, wrench.f.dot(normal_W));
  }
  return wrench;
}

}  // namespace tandem::client
