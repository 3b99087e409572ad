#include "common/haptics/coupling/passivity_guard.hpp"

namespace tandem::haptics {

Wrench PassivityGuard::apply(const Pose& X_WH, const Wrench& on_hand_W, double work_on_tool_j,
                             double period_s) noexcept {
  settle_tool(work_on_tool_j);
  const Wrench held = displayed_;
  displayed_ = {};
  if (!is_finite(X_WH) || !std::isfinite(period_s)) return {};
  const Vec3 step = has_pose_ ? Vec3(X_WH.p - X_WH_.p) : Vec3::Zero();
  const Vec3 turn = has_pose_ ? rotation_vector(X_WH.q * X_WH_.q.conjugate()) : Vec3::Zero();
  credit(-held.f.dot(step) - held.t.dot(turn));
  X_WH_ = X_WH;
  has_pose_ = true;
  if (!is_finite(on_hand_W)) return {};
  const double period_square = period_s * period_s;
  const double most = on_hand_W.f.norm() * (step.norm() + settings_.acceleration_m_per_s2 * period_square) +
                      on_hand_W.t.norm() * (turn.norm() + settings_.acceleration_rad_per_s2 * period_square);
  // Norms of huge numbers overflow.
  if (!std::isfinite(most)) return {};
  const double available = std::max(0.0, account_j_ + settings_.allowance_j);
  if (most <= available) return displayed_ = on_hand_W;
  withheld_j_ = std::min(withheld_j_ + (most - available), std::numeric_limits<double>::max());
  return displayed_ = on_hand_W * (available / most);
}

void PassivityGuard::set_displayed(const Wrench& on_hand_W) noexcept {
  displayed_ = is_finite(on_hand_W) ? on_hand_W : Wrench{};
}

void PassivityGuard::reset() noexcept {
  *this = PassivityGuard(settings_);
}

void PassivityGuard::credit(double energy_j) noexcept {
  if (std::isfinite(account_j_ + energy_j)) account_j_ += energy_j;
}

void PassivityGuard::settle_tool(double work_on_tool_j) noexcept {
  if (!std::isfinite(lent_to_tool_j_ + work_on_tool_j)) return;
  lent_to_tool_j_ += work_on_tool_j;
  if (lent_to_tool_j_ >= 0) return;
  credit(-lent_to_tool_j_);
  lent_to_tool_j_ = 0;
}

}  // namespace tandem::haptics
