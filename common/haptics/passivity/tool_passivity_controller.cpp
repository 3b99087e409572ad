// See tool_passivity_controller.hpp.
#include "common/haptics/passivity/tool_passivity_controller.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::haptics {

void ToolPassivityController::hand_reported(double from_hand_j, double to_hand_j, double elapsed_s) noexcept {
  add_to_balance(hand_.take(from_hand_j, to_hand_j, elapsed_s));
}

void ToolPassivityController::stepped(const Pose& X_WT, const Wrench& on_tool_W, double net_into_world_j) noexcept {
  if (!is_finite(X_WT)) return;
  port_.move_to(X_WT);
  note_full_wrench(on_tool_W);
  if (!std::isfinite(net_into_world_j)) return;
  add_to_balance(net_into_world_j_ - net_into_world_j);
  net_into_world_j_ = net_into_world_j;
}

// What the whole coupling would have done, not what was left of it.
void ToolPassivityController::note_full_wrench(const Wrench& on_tool_W) noexcept {
  constexpr double kMinGain = 1e-6;
  if (gain_ < kMinGain) return;
  const Wrench full = on_tool_W * (1 / gain_);
  full_on_tool_W_ = is_finite(full) ? full : Wrench{};
}

double ToolPassivityController::gain(double step_s) noexcept {
  if (!(step_s > 0) || !std::isfinite(step_s)) return gain_;
  if (balance_j_ < 0) balance_j_ = std::min(0.0, balance_j_ + kLeakRate_w * step_s);
  const double needed_j = kStepsAhead * port_.max_work_j(full_on_tool_W_, step_s);
  const double available_j = std::max(0.0, balance_j_ + kInitialCredit_j);
  gain_ = available_j > 0 ? next_passivity_gain(gain_, needed_j, available_j, step_s) : 0;
  limited_steps_ += gain_ < 1 ? 1 : 0;
  return gain_;
}

void ToolPassivityController::restart_handle(double stored_j) noexcept {
  balance_j_ = std::max(balance_j_, 0.0);
  if (stored_j > 0) add_to_balance(stored_j);
}

void ToolPassivityController::add_to_balance(double energy_j) noexcept {
  const double balance_j = balance_j_ + energy_j;
  if (std::isfinite(balance_j)) balance_j_ = std::clamp(balance_j, kMinBalance_j, kMaxBalance_j);
}

}  // namespace tandem::haptics
