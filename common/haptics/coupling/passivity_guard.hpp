// Sampling creates energy: a spring whose force is held for a period gives back more than was put in. The guard keeps
// the account of the coupling as a port between hand and tool, and lets the hand have no more than is in it. For loops
// that step hand and tool together, as the lab's hand rig does. Not part of the live client: its tool is stepped at the
// other end of a network, and what was done on it is not known in time.
#pragma once

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

/// Time-domain passivity observer and controller of a coupling whose tool is stepped in the same loop as the hand.
///
/// Model   account E_k = −Σ F_j·(x_{j+1} − x_j) − Σ τ_j·θ_{j,j+1} + (what the tool gave beyond all that it ever got),
///         F, τ as displayed and held. The next step can take at most |F| δ + |τ| δ_θ, δ = |x_k − x_{k−1}| + a T²,
///         whichever way the hand turns; the wrench is scaled down so that E_k + allowance covers it. Nothing is
///         changed while the account has enough, which is nearly always.
///         Why it holds: the hand takes no more than E + allowance in any step, and what a tool without a source of
///         its own gives back, it got before; so from rest the hand never gets more than the allowance.
///         What the tool gets is no debit: with the hand's force scaled it would be charged with what the hand could
///         not pay, and the force would never come back.
/// Source  Hannaford, Ryu, "Time-domain passivity control of haptic interfaces", IEEE T-RA 18(1), 2002; theirs looks
///         back and adds damping, ours looks one step ahead and scales
/// Limits  Valid only where work_on_tool_j is that of the same period: no delay, no network between hand and tool.
///         What dampers and friction took stays in the account: the guard bounds what is created since reset(), not a
///         limit cycle after long work. The account is of the positions that it is told: what a hand does within the
///         steps of an encoder is not in it. A hand that accelerates more than stated overdraws it by |F| times the
///         excess, once, until it is paid back.
/// Thread  haptic: no allocation, no throw; output finite for any input
class PassivityGuard {
 public:
  struct Settings {
    double allowance_j = 8e-6;           ///< what may be missing: without it the first touch would be refused
    double acceleration_m_per_s2 = 100;  ///< the most that the speed of hand and device can change by
    double acceleration_rad_per_s2 = 5000;
  };
  explicit PassivityGuard(const Settings& settings) : settings_(settings) {}

  /// What may be displayed until the next tick.
  /// In      X_WH  handle at this tick; on_hand_W  about the handle; work_on_tool_j  of the coupling on the tool since
  ///         the last tick, negative when the tool gave
  /// Fails   zero for a pose, wrench or period that is not finite; the account is kept
  Wrench apply(const Pose& X_WH, const Wrench& on_hand_W, double work_on_tool_j, double period_s) noexcept;
  /// What was really displayed, when later stages changed it.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  void reset() noexcept;

  double account_j() const { return account_j_; }
  /// Sum over ticks of what scaling kept from the hand: the most that it could have taken, less what it still may.
  double withheld_j() const { return withheld_j_; }

 private:
  void credit(double energy_j) noexcept;
  void settle_tool(double work_on_tool_j) noexcept;

  Settings settings_;
  bool has_pose_ = false;
  Pose X_WH_;
  Wrench displayed_;
  double account_j_ = 0;
  double lent_to_tool_j_ = 0;
  double withheld_j_ = 0;
};

}  // namespace tandem::haptics
