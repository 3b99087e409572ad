#include "common/haptics/passivity/coupling_passivity_controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

Wrench CouplingPassivityController::apply(const Pose& X_WH, const Wrench& on_hand_W, double work_on_tool_j,
                                          double period_s) noexcept {
  add_tool_output(work_on_tool_j);
  const Wrench held = displayed_;
  displayed_ = {};
  if (!is_finite(X_WH) || !std::isfinite(period_s)) return {};
  if (port_.has_pose()) add_to_balance(-held_work_j(held, port_.pose(), X_WH));
  port_.move_to(X_WH);
  if (!is_finite(on_hand_W)) return {};
  const double max_work_j = port_.max_work_j(on_hand_W, period_s);
  // Norms overflow for extremely large components.
  if (!std::isfinite(max_work_j)) return {};
  const double available_j = std::max(0.0, balance_j_ + kInitialCredit_j);
  if (max_work_j <= available_j) return displayed_ = on_hand_W;
  withheld_j_ = std::min(withheld_j_ + (max_work_j - available_j), std::numeric_limits<double>::max());
  return displayed_ = on_hand_W * (available_j / max_work_j);
}

void CouplingPassivityController::set_displayed(const Wrench& on_hand_W) noexcept {
  displayed_ = is_finite(on_hand_W) ? on_hand_W : Wrench{};
}

void CouplingPassivityController::add_to_balance(double energy_j) noexcept {
  if (std::isfinite(balance_j_ + energy_j)) balance_j_ += energy_j;
}

void CouplingPassivityController::add_tool_output(double work_on_tool_j) noexcept {
  if (!std::isfinite(stored_by_tool_j_ + work_on_tool_j)) return;
  stored_by_tool_j_ += work_on_tool_j;
  if (stored_by_tool_j_ >= 0) return;
  add_to_balance(-stored_by_tool_j_);
  stored_by_tool_j_ = 0;
}

}  // namespace tandem::haptics
