// The tool's end of a user's energy account, at the server: the tool may put into the world what the client says the
// hand has paid, and what it got from the world before; no more. A tool that merely follows a late pose pays nothing.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/energy_report.hpp"

namespace tandem::haptics {

/// How much of a user's coupling may act in the next step.
///
/// Model   paid P = Σ from_hand − Σ to_hand as reported; spent S = Σ into_world − Σ from_world as measured. The next
///         step can put in at most m = |F| (δ + a T²) + |τ| (δ_θ + α T²), with the wrench and the tool's step of the
///         last one. gain = min(1, (P − S + allowance) / (n m)), falling at once, rising slowly. The room scales
///         all that pulls for the user by it (World::limit_pull()).
///         Pose and payment travel in one message, so the delay by itself makes no debt: what the tool does now answers
///         a hand that had paid so much then. Of inputs that are played out, the payment is played out with them.
///         Debt is forgiven slowly, and beyond most_debt_j not kept: P falls while the hand is given what it put in
///         itself, which is its own end's to watch (GuardedPort), and a tool would be dead until its user joins again.
/// Limits  m is of the last step's wrench: one that grows within a step (first contact) overdraws once, and is paid
///         back before more is let through. Braking is held back like driving. Dissipation on the hand's side stays in
///         P up to account_limit_j.
/// Source  as GuardedPort
/// Thread  room: no allocation, no throw
class ToolPortGuard {
 public:
  struct Settings {
    double allowance_j = 5e-3;  ///< what the coupling itself may store before the hand's first report
    /// Debt is forgiven so fast: a tool that is not pulled at all gives its hand nothing to pay against.
    double forgiven_w = 2e-3;
    double most_debt_j = 0.05;
    double account_limit_j = 2.0;
    double credit_limit_w = 20.0;
    double steps_ahead = 4.0;  ///< n
    double rise_s = 0.05;
    double acceleration_m_per_s2 = 100;
    double acceleration_rad_per_s2 = 5000;
  };
  explicit ToolPortGuard(const Settings& settings) : settings_(settings), hand_(settings.credit_limit_w) {}

  /// The client's running sums, for every input that came; `elapsed_s` since the one before.
  void hand_reported(double from_hand_j, double to_hand_j, double elapsed_s) noexcept;
  /// After a step: where the tool is, what the coupling, scaled by the last gain(), did on it, and the world's running
  /// sum of what this user put in less what he drew (its own, so trusted).
  void stepped(const Pose& X_WT, const Wrench& on_tool_W, double net_into_world_j) noexcept;
  /// What share of the coupling may act in the coming step, 0 … 1.
  double gain(double step_s) noexcept;
  /// The handle begins somewhere else than the last was, or than the tool is, with no way there that could have been
  /// paid: debt is forgotten, and what the coupling is stretched by is lent.
  void handle_began(double stretched_j) noexcept;
  /// A new user, or a new session of the same.
  void reset() noexcept { *this = ToolPortGuard(settings_); }

  double account_j() const noexcept { return account_j_; }
  std::uint64_t acted_steps() const noexcept { return acted_steps_; }
  std::uint64_t dropped_reports() const noexcept { return hand_.dropped(); }

 private:
  void note_full_wrench(const Wrench& on_tool_W) noexcept;
  void credit(double energy_j) noexcept;

  Settings settings_;
  EnergyReport hand_;
  bool has_pose_ = false;
  Pose X_WT_;
  double step_m_ = 0;
  double turn_rad_ = 0;
  Wrench full_on_tool_W_;  ///< as if gain were 1
  double net_into_world_j_ = 0;
  double account_j_ = 0;
  double gain_ = 1;
  std::uint64_t acted_steps_ = 0;
};

}  // namespace tandem::haptics
