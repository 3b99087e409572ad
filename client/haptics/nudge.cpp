#include "client/haptics/nudge.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::client {
namespace {

constexpr double kMaxAmplitude_n = 0.3, kShareOfLimit = 0.1;
constexpr double kPeriod_s = 0.25, kPulse_s = 0.08, kPulses = 3;

}  // namespace

Nudge::Nudge(double force_limit_n) noexcept : amplitude_n_(std::min(kMaxAmplitude_n, kShareOfLimit * force_limit_n)) {}

void Nudge::begin(const Vec3& way_W, const Quat& q_DW) noexcept {
  if (is_running()) return;
  elapsed_s_ = 0;
  if (way_W.allFinite() && way_W.norm() > 1e-6) direction_D_ = q_DW * way_W.normalized();
}

void Nudge::advance(double period_s, bool may_push) noexcept {
  on_hand_D_.setZero();
  if (!is_running()) return;
  elapsed_s_ += period_s;
  const double into_s = std::fmod(elapsed_s_, kPeriod_s);
  if (elapsed_s_ >= kPulses * kPeriod_s || !may_push) {
    direction_D_.setZero();
  } else if (into_s < kPulse_s) {
    const double rise = std::sin(std::numbers::pi * into_s / kPulse_s);
    on_hand_D_ = amplitude_n_ * rise * rise * direction_D_;
  }
}

}  // namespace tandem::client
