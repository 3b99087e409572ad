#include "common/haptics/passivity/hand_passivity_controller.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/spatial.hpp"

namespace tandem::haptics {
namespace {

/// Adds `net_j` to the running net output of a source. `below_peak_j` is the distance of this output below its maximum
/// so far. Returns the amount by which the maximum rises.
double rise_above_peak_j(double& below_peak_j, double net_j) noexcept {
  below_peak_j -= net_j;
  const double risen_j = std::max(0.0, -below_peak_j);
  below_peak_j = std::max(0.0, below_peak_j);
  return risen_j;
}

}  // namespace

void HandPassivityController::world_reported(double from_world_j, double into_world_j, double elapsed_s,
                                             bool has_model) noexcept {
  const double net_j = world_.accept(from_world_j, into_world_j, elapsed_s);
  const double risen_j = rise_above_peak_j(world_below_peak_j_, net_j);
  add_to_balance(has_model ? risen_j : net_j);
}

void HandPassivityController::local_model_reported(double net_j) noexcept {
  if (!std::isfinite(net_j)) return;
  if (has_local_) add_to_balance(rise_above_peak_j(local_below_peak_j_, net_j - local_net_j_));
  has_local_ = true;
  local_net_j_ = net_j;
}

Wrench HandPassivityController::apply(const Pose& X_WH, const Wrench& on_hand_W, double period_s) noexcept {
  if (is_finite(X_WH)) end_period(X_WH, period_s);
  displayed_ = withheld_ = left_out_later_ = {};
  if (!is_finite(X_WH) || !is_finite(on_hand_W) || !(period_s > 0) || !std::isfinite(period_s)) return {};
  const double ahead_j = std::max(0.0, port_.expected_work_j(on_hand_W));
  // Norms overflow for extremely large components.
  if (!std::isfinite(ahead_j)) return {};
  if (balance_j_ < 0) balance_j_ = std::min(0.0, balance_j_ + kLeakRate_w * std::min(period_s, kPeriod_s));
  const double available_j = std::max(0.0, balance_j_ + kInitialCredit_j);
  gain_ = next_passivity_gain(gain_, kPeriodsAhead * ahead_j, available_j, period_s);
  gain_ = std::min(gain_, std::clamp((balance_j_ - kMinBalance_j) / (-kMinBalance_j - kInitialCredit_j), 0.0, 1.0));
  limited_ticks_ += gain_ < 1 ? 1 : 0;
  displayed_ = on_hand_W * gain_;
  withheld_ = on_hand_W * (1 - gain_);
  return displayed_;
}

void HandPassivityController::end_period(const Pose& X_WH, double period_s) noexcept {
  const double share = period_s > kPeriod_s ? kPeriod_s / period_s : 1.0;
  if (port_.has_pose()) {
    const double work_j = held_work_j(displayed_, port_.pose(), X_WH);
    add_to_balance(work_j > 0 ? -share * work_j : -work_j);
    exchanged_j_ += std::abs(work_j);
    // Later safety stages removed a part of the wrench on the hand, but the world's tool was still pulled by the whole
    // wrench. The work against the removed part is therefore stored in the world. The hand did not do it, but may
    // receive it, so it is added to the balance.
    add_to_balance(std::max(0.0, -held_work_j(left_out_later_, port_.pose(), X_WH)));
    withheld_j_ += std::max(0.0, held_work_j(withheld_, port_.pose(), X_WH));
  }
  port_.move_to(X_WH, share);
}

void HandPassivityController::set_displayed(const Wrench& on_hand_W) noexcept {
  const Wrench really = is_finite(on_hand_W) ? on_hand_W : Wrench{};
  left_out_later_ = displayed_ - really;
  displayed_ = really;
}

void HandPassivityController::add_to_balance(double energy_j) noexcept {
  const double balance_j = balance_j_ + energy_j;
  if (std::isfinite(balance_j)) balance_j_ = std::clamp(balance_j, kMinBalance_j, kMaxBalance_j);
}

void HandPassivityController::reset() noexcept {
  HandPassivityController fresh;
  fresh.withheld_j_ = withheld_j_;
  fresh.exchanged_j_ = exchanged_j_;
  fresh.limited_ticks_ = limited_ticks_;
  *this = fresh;
}

}  // namespace tandem::haptics
