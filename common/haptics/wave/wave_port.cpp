#include "common/haptics/wave/wave_port.hpp"

#include <algorithm>

#include "common/base/spatial.hpp"

namespace tandem::haptics {
namespace {

Twist mean_velocity(const Pose& from, const Pose& to, double period_s) {
  return {(to.p - from.p) / period_s, rotation_vector(to.q * from.q.conjugate()) / period_s};
}

bool is_period(double period_s) {
  return std::isfinite(period_s) && period_s > 0;
}

}  // namespace

Wave WaveAccount::settle(const Wave& in, const Wave& out, double work_j, double period_s) noexcept {
  const double before_out_j = balance_j_ + squared(in) * period_s / 2 - work_j;
  const double cost_j = squared(out) * period_s / 2;
  if (!std::isfinite(before_out_j) || !std::isfinite(cost_j)) return {};
  const double covered_j = std::clamp(before_out_j, 0.0, cost_j);
  balance_j_ = std::min(kLimit_j, before_out_j - covered_j);
  return covered_j < cost_j ? out * std::sqrt(covered_j / cost_j) : out;
}

Wrench WaveHandPort::tick(const Pose& X_WH, double period_s) noexcept {
  if (!is_finite(X_WH) || !is_period(period_s)) {
    // Until the next valid pose the hand receives no force, because the work on a hand of unknown motion is unknown.
    lose_hand();
    return displayed_ = {};
  }
  end_period(X_WH, period_s);
  in_ = player_.play(period_s);
  // For the velocity V and the incoming wave, the wrench of the hand on the line is b V − √(2b) in. The hand receives
  // the opposite wrench.
  const WaveImpedance& b = impedance_;
  displayed_ = {std::sqrt(2 * b.linear_n_s_per_m) * in_.f - b.linear_n_s_per_m * velocity_.v,
                std::sqrt(2 * b.angular_n_m_s_per_rad) * in_.t - b.angular_n_m_s_per_rad * velocity_.w};
  return displayed_;
}

void WaveHandPort::lose_hand() noexcept {
  has_pose_ = false;
  velocity_ = {};
}

void WaveHandPort::end_period(const Pose& X_WH, double period_s) noexcept {
  if (has_pose_) {
    velocity_ = mean_velocity(X_WH_, X_WH, period_s);
    const WaveImpedance& b = impedance_;
    const Wave out =
        Wave{std::sqrt(2 * b.linear_n_s_per_m) * velocity_.v, std::sqrt(2 * b.angular_n_m_s_per_rad) * velocity_.w} -
        in_;
    sum_ = wave_sum(sum_, account_.settle(in_, out, held_work_j(displayed_, X_WH_, X_WH), period_s), period_s);
  }
  X_WH_ = X_WH;
  has_pose_ = true;
}

void WaveHandPort::set_displayed(const Wrench& on_hand_W) noexcept {
  displayed_ = is_finite(on_hand_W) ? on_hand_W : Wrench{};
}

const Pose& WaveToolPort::move(const Pose& X_WH_hand, const CouplingParameters& coupling, double period_s) noexcept {
  if (!is_finite(X_WH_hand) || !is_period(period_s)) {
    // Without a valid input the virtual handle rests in this step. The energy balance already contains the wave and the
    // motion of the previous step.
    in_ = {};
    velocity_ = {};
    X_before_ = X_;
    return X_;
  }
  if (!has_pose_) X_ = X_WH_hand;
  has_pose_ = true;
  in_ = player_.play(period_s);
  velocity_ = answer(in_, coupling, period_s);
  const Twist drift = drift_correction(X_WH_hand, period_s);
  velocity_.v += drift.v;
  velocity_.w += drift.w;
  X_before_ = X_;
  X_ = integrate(X_, velocity_, period_s);
  return X_;
}

Twist WaveToolPort::answer(const Wave& in, const CouplingParameters& coupling, double period_s) const noexcept {
  const WaveImpedance& b = impedance_;
  const auto solved = [period_s](const Vec3& wave, const Vec3& force, const Vec3& velocity, double impedance,
                                 double stiffness, double damping) {
    return Vec3((std::sqrt(2 * impedance) * wave - force + damping * velocity) /
                (impedance + stiffness * period_s + damping));
  };
  return {solved(in.f, on_tool_W_.f, velocity_.v, b.linear_n_s_per_m, coupling.stiffness_n_per_m,
                 coupling.damping_n_s_per_m),
          solved(in.t, on_tool_W_.t, velocity_.w, b.angular_n_m_s_per_rad, coupling.stiffness_n_m_per_rad,
                 coupling.damping_n_m_s_per_rad)};
}

Twist WaveToolPort::drift_correction(const Pose& X_WH_hand, double period_s) const noexcept {
  const Twist drift{
      clamped_to_length((X_WH_hand.p - X_.p) / kDriftTime_s, kDriftSpeed_m_per_s),
      clamped_to_length(rotation_vector(X_WH_hand.q * X_.q.conjugate()) / kDriftTime_s, kDriftTurn_rad_per_s)};
  const double cost_j = (on_tool_W_.f.dot(drift.v) + on_tool_W_.t.dot(drift.w)) * period_s;
  const double available_j = std::max(0.0, account_.balance_j());
  if (cost_j <= available_j) return drift;
  const double share = available_j / cost_j;
  return {drift.v * share, drift.w * share};
}

void WaveToolPort::settle(const Wrench& on_tool_W, double period_s) noexcept {
  if (!has_pose_ || !is_period(period_s)) return;
  on_tool_W_ = is_finite(on_tool_W) ? on_tool_W : Wrench{};
  const Wave out = wave_towards_hand(impedance_, velocity_, on_tool_W_);
  sum_ = wave_sum(sum_, account_.settle(in_, out, held_work_j(on_tool_W_, X_before_, X_), period_s), period_s);
}

}  // namespace tandem::haptics
