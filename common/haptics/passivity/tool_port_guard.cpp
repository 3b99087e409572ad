// See tool_port_guard.hpp.
#include "common/haptics/passivity/tool_port_guard.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::haptics {

void ToolPortGuard::hand_reported(double from_hand_j, double to_hand_j, double elapsed_s) noexcept {
  credit(hand_.take(from_hand_j, to_hand_j, elapsed_s));
}

void ToolPortGuard::stepped(const Pose& X_WT, const Wrench& on_tool_W, double net_into_world_j) noexcept {
  if (!is_finite(X_WT)) return;
  step_m_ = has_pose_ ? (X_WT.p - X_WT_.p).norm() : 0.0;
  turn_rad_ = has_pose_ ? rotation_vector(X_WT.q * X_WT_.q.conjugate()).norm() : 0.0;
  X_WT_ = X_WT;
  has_pose_ = true;
  note_full_wrench(on_tool_W);
  if (!std::isfinite(net_into_world_j)) return;
  credit(net_into_world_j_ - net_into_world_j);
  net_into_world_j_ = net_into_world_j;
}

// What the whole coupling would have done, not what was left of it.
void ToolPortGuard::note_full_wrench(const Wrench& on_tool_W) noexcept {
  constexpr double kMinGain = 1e-6;
  if (gain_ < kMinGain) return;
  const Wrench full = on_tool_W * (1 / gain_);
  full_on_tool_W_ = is_finite(full) ? full : Wrench{};
}

double ToolPortGuard::gain(double step_s) noexcept {
  if (!(step_s > 0) || !std::isfinite(step_s)) return gain_;
  if (account_j_ < 0) account_j_ = std::min(0.0, account_j_ + settings_.forgiven_w * step_s);
  const double square = step_s * step_s;
  const double most_j = full_on_tool_W_.f.norm() * (step_m_ + settings_.acceleration_m_per_s2 * square) +
                        full_on_tool_W_.t.norm() * (turn_rad_ + settings_.acceleration_rad_per_s2 * square);
  const double wanted_j = settings_.steps_ahead * most_j;
  const double available_j = std::max(0.0, account_j_ + settings_.allowance_j);
  const double risen = std::min(1.0, gain_ + step_s / settings_.rise_s);
  gain_ = wanted_j > available_j ? std::min(risen, available_j / wanted_j) : risen;
  if (available_j <= 0) gain_ = 0;
  acted_steps_ += gain_ < 1 ? 1 : 0;
  return gain_;
}

void ToolPortGuard::handle_began(double stretched_j) noexcept {
  account_j_ = std::max(account_j_, 0.0);
  if (stretched_j > 0) credit(stretched_j);
}

void ToolPortGuard::credit(double energy_j) noexcept {
  const double account_j = account_j_ + energy_j;
  if (!std::isfinite(account_j)) return;
  account_j_ = std::clamp(account_j, -settings_.most_debt_j, settings_.account_limit_j);
}

}  // namespace tandem::haptics
