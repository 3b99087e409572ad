// See guarded_port.hpp.
#include "common/haptics/passivity/guarded_port.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/work.hpp"

namespace tandem::haptics {

double GuardedPort::Gift::add(double net_j) noexcept {
  lent_j_ -= net_j;
  const double risen_j = std::max(0.0, -lent_j_);
  lent_j_ = std::max(0.0, lent_j_);
  return risen_j;
}

void GuardedPort::world_reported(double from_world_j, double into_world_j, double elapsed_s) noexcept {
  credit(world_gift_.add(world_.take(from_world_j, into_world_j, elapsed_s)));
}

void GuardedPort::local_gave(double net_j) noexcept {
  if (!std::isfinite(net_j)) return;
  if (has_local_) credit(local_gift_.add(net_j - local_net_j_));
  has_local_ = true;
  local_net_j_ = net_j;
}

Wrench GuardedPort::apply(const Pose& X_WH, const Wrench& on_hand_W, double period_s) noexcept {
  if (is_finite(X_WH)) end_period(X_WH, period_s);
  displayed_ = kept_back_ = spared_ = {};
  if (!is_finite(X_WH) || !is_finite(on_hand_W) || !(period_s > 0) || !std::isfinite(period_s)) return {};
  const double most_j = most_of_next_period_j(on_hand_W);
  // Norms of huge numbers overflow.
  if (!std::isfinite(most_j)) return {};
  const double available_j = std::max(0.0, account_j_ + settings_.allowance_j);
  const double risen = std::min(1.0, gain_ + period_s / settings_.rise_s);
  const double wanted_j = settings_.periods_ahead * most_j;
  gain_ = wanted_j > available_j ? std::min(risen, available_j / wanted_j) : risen;
  acted_ticks_ += gain_ < 1 ? 1 : 0;
  displayed_ = on_hand_W * gain_;
  kept_back_ = on_hand_W * (1 - gain_);
  return displayed_;
}

void GuardedPort::end_period(const Pose& X_WH, double period_s) noexcept {
  if (has_pose_) {
    const double share = period_s > settings_.period_s ? settings_.period_s / period_s : 1.0;
    step_m_ = share * (X_WH.p - X_WH_.p).norm();
    turn_rad_ = share * rotation_vector(X_WH.q * X_WH_.q.conjugate()).norm();
    const double work_j = held_work_j(displayed_, X_WH_, X_WH);
    credit(work_j > 0 ? -share * work_j : -work_j);
    exchanged_j_ += std::abs(work_j);
    // What the safety stages spared the hand it would have paid, and what is stored for it waits to be let out.
    credit(std::max(0.0, -held_work_j(spared_, X_WH_, X_WH)));
    withheld_j_ += std::max(0.0, held_work_j(kept_back_, X_WH_, X_WH));
  } else {
    step_m_ = turn_rad_ = 0;
  }
  X_WH_ = X_WH;
  has_pose_ = true;
}

double GuardedPort::most_of_next_period_j(const Wrench& on_hand_W) const noexcept {
  const double square = settings_.period_s * settings_.period_s;
  return on_hand_W.f.norm() * (step_m_ + settings_.acceleration_m_per_s2 * square) +
         on_hand_W.t.norm() * (turn_rad_ + settings_.acceleration_rad_per_s2 * square);
}

void GuardedPort::set_displayed(const Wrench& on_hand_W) noexcept {
  const Wrench really = is_finite(on_hand_W) ? on_hand_W : Wrench{};
  spared_ = displayed_ - really;
  displayed_ = really;
}

void GuardedPort::credit(double energy_j) noexcept {
  const double account_j = account_j_ + energy_j;
  if (std::isfinite(account_j)) account_j_ = std::min(account_j, settings_.account_limit_j);
}

// The figures are of the whole run: a new connection starts the account anew, not the report.
void GuardedPort::reset() noexcept {
  GuardedPort fresh(settings_);
  fresh.withheld_j_ = withheld_j_;
  fresh.exchanged_j_ = exchanged_j_;
  fresh.acted_ticks_ = acted_ticks_;
  *this = fresh;
}

}  // namespace tandem::haptics
