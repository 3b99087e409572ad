// Passivity controller of a tool's port, at the server: the tool may put into the world the energy that the client
// says its hand has put in, and that it took from the world before; no more. A stage whose tool merely follows a late
// pose reports no energy of its hand.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/energy_report.hpp"
#include "common/haptics/passivity/port_look_ahead.hpp"

namespace tandem::haptics {

/// Which share of a user's coupling may act in the next step.
///
/// Model   energy balance E = (Σ from_hand − Σ to_hand, as reported) − (Σ into_world − Σ from_world, as measured).
///         gain = min(1, (E + initial credit) / (n m)), falling at once, rising slowly; m the bound of PortLookAhead
///         with wrench and motion of the last step. The room scales by it everything that acts for the user
///         (World::limit_pull()).
///         Pose and energy travel in one message, so the delay by itself makes no negative balance: what the tool does
///         now answers a hand that had put in so much then. Of inputs that are played out, the energies are played out
///         with them.
///         A negative balance leaks back to zero at kLeakRate_w and is bounded by kMinBalance_j: E falls while the hand
///         is given back what it put in itself, which is for the hand's controller (HandPassivityController) to limit,
///         and a tool would not act until its user joins again.
/// Limits  m is of the last step's wrench: one that grows within a step (first contact) overdraws once, and the balance
///         recovers before more is let through. Braking is limited like driving. Energy dissipated on the hand's side
///         stays in the balance up to kMaxBalance_j.
/// Source  as HandPassivityController
/// Thread  room: no allocation, no throw
class ToolPassivityController {
 public:
  static constexpr double kInitialCredit_j = 5e-3;  ///< what the coupling may store before the hand's first report
  /// A tool that does not act gives its hand nothing to work against, so the balance must recover by itself.
  static constexpr double kLeakRate_w = 2e-3;
  static constexpr double kMinBalance_j = -0.05;
  static constexpr double kMaxBalance_j = 2.0;
  static constexpr double kStepsAhead = 4.0;  ///< n

  /// The client's running sums, for every input that came; `elapsed_s` since the one before.
  void hand_reported(double from_hand_j, double to_hand_j, double elapsed_s) noexcept;
  /// After a step: where the tool is, what the coupling, scaled by the last gain(), did on it, and the world's running
  /// sum of what this user put in less what he drew (its own, so trusted).
  void stepped(const Pose& X_WT, const Wrench& on_tool_W, double net_into_world_j) noexcept;
  /// The share of the coupling that may act in the coming step, 0 … 1.
  double gain(double step_s) noexcept;
  /// The handle starts somewhere else than the last one ended, or than the tool is, without a motion along which its
  /// hand could have done work: a negative balance is cleared, and what the coupling stores is credited.
  void restart_handle(double stored_j) noexcept;
  /// A new user, or a new session of the same.
  void reset() noexcept { *this = ToolPassivityController(); }

  double balance_j() const noexcept { return balance_j_; }
  std::uint64_t limited_steps() const noexcept { return limited_steps_; }
  std::uint64_t dropped_reports() const noexcept { return hand_.dropped(); }

 private:
  void note_full_wrench(const Wrench& on_tool_W) noexcept;
  void add_to_balance(double energy_j) noexcept;

  EnergyReport hand_;
  PortLookAhead port_;
  Wrench full_on_tool_W_;  ///< as if gain were 1
  double net_into_world_j_ = 0;
  double balance_j_ = 0;
  double gain_ = 1;
  std::uint64_t limited_steps_ = 0;
};

}  // namespace tandem::haptics
