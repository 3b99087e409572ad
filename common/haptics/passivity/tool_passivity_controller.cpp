#include "common/haptics/passivity/tool_passivity_controller.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::haptics {
namespace {

constexpr double kRise_s = 0.002;
constexpr double kFall_s = 0.05;
/// Time after a contact during which the tool still counts as touching, so that the brake stays on while the tool
/// bounces.
constexpr double kIdle_s = 0.1;
/// A brake weaker than this value is set to zero, because it would be imperceptible: 0.01 N at 0.1 m/s.
constexpr double kNoBrake_n_s_per_m = 0.1;

double max_brake_n_s_per_m(double missing_j) noexcept {
  using Controller = ToolPassivityController;
  const double firm_at_j = -Controller::kMinBalance_j - Controller::kInitialCredit_j;
  const double way = (missing_j - Controller::kGentleUpTo_j) / (firm_at_j - Controller::kGentleUpTo_j);
  return std::lerp(Controller::kGentleBrake_n_s_per_m, Controller::kFirmBrake_n_s_per_m, std::clamp(way, 0.0, 1.0));
}

}  // namespace

void ToolPassivityController::hand_reported(double from_hand_j, double to_hand_j, double elapsed_s,
                                            double could_do_j) noexcept {
  add_to_balance(hand_.accept(from_hand_j, to_hand_j, elapsed_s, could_do_j));
}

void ToolPassivityController::stepped(const Pose& X_WT, const Wrench& on_tool_W, double net_into_world_j) noexcept {
  if (!is_finite(X_WT)) return;
  port_.move_to(X_WT);
  on_tool_W_ = is_finite(on_tool_W) ? on_tool_W : Wrench{};
  if (!std::isfinite(net_into_world_j)) return;
  add_to_balance(net_into_world_j_ - net_into_world_j);
  net_into_world_j_ = net_into_world_j;
}

double ToolPassivityController::brake_n_s_per_m(double step_s, bool acts) noexcept {
  if (!(step_s > 0) || !std::isfinite(step_s)) return brake_n_s_per_m_;
  if (balance_j_ < 0) balance_j_ = std::min(0.0, balance_j_ + kLeakRate_w * step_s);
  const double ahead_j = kStepsAhead * std::max(0.0, port_.expected_work_j(on_tool_W_));
  const double missing_j = std::max(0.0, ahead_j - balance_j_ - kInitialCredit_j);
  const double speed = std::max(kSlow_m_per_s, port_.moved_m(kLever_m) / step_s);
  idle_s_ = acts ? 0 : idle_s_ + step_s;
  const double most = idle_s_ < kIdle_s ? max_brake_n_s_per_m(missing_j) : 0;
  const double wanted = std::min(most, missing_j / (kPayBack_s * speed * speed));
  if (!std::isfinite(wanted)) return brake_n_s_per_m_;
  const double time_s = wanted > brake_n_s_per_m_ ? kRise_s : kFall_s;
  brake_n_s_per_m_ += (wanted - brake_n_s_per_m_) * std::min(1.0, step_s / time_s);
  if (brake_n_s_per_m_ < kNoBrake_n_s_per_m) brake_n_s_per_m_ = 0;
  limited_steps_ += brake_n_s_per_m_ > 0 ? 1 : 0;
  return brake_n_s_per_m_;
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
