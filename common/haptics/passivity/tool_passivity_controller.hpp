// Passivity controller of a tool's port, at the server: the tool may put into the world the energy that the client
// says its hand has put in, and that it took from the world before; no more. A stage whose tool merely follows a late
// pose reports no energy of its hand.
#pragma once

#include <cstdint>
#include <limits>

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/energy_report.hpp"
#include "common/haptics/passivity/port_look_ahead.hpp"

namespace tandem::haptics {

/// How much a user's pull brakes what it moves in the next step.
///
/// Model   energy balance E = (Σ from_hand − Σ to_hand, as reported) − (Σ into_world − Σ from_world, as measured, after
///         the brake). What is missing, D = n max(0, m) − E − initial credit where that is above 0, m the work of the
///         coming step if the tool moves on as it did, is braked away within kPayBack_s: b = D / (kPayBack_s u²), u the
///         tool's speed and its turning at kLever_m, at least kSlow_m_per_s. The brake comes and goes gradually, and is
///         gentle while little is missing: at most kGentleBrake_n_s_per_m up to kGentleUpTo_j, then evenly more, to
///         kFirmBrake_n_s_per_m at the least balance. A firm one shakes what two users squeeze between them.
///         The room gives b to everything that acts for the user (World::brake()). A brake does nothing at rest, so what
///         is held or pressed stays so: an error of the client's model, whose hand paid for a lighter thing, makes the
///         thing heavier to move, and drops nothing.
///         Pose and energy travel in one message, so the delay by itself makes no negative balance: what the tool does
///         now answers a hand that had put in so much then. Of inputs that are played out, the energies are played out
///         with them.
///         A negative balance leaks back to zero at kLeakRate_w and is bounded by kMinBalance_j: E falls while the hand
///         is given back what it put in itself, which is for the hand's controller (HandPassivityController) to limit.
/// Limits  m is of the last step's wrench: one that grows within a step (first contact) overdraws once, and is braked
///         away after. A pull of 6 N without any supply creeps at 3 mm/s once the balance is at its least. Energy
///         dissipated on the hand's side stays in the balance up to kMaxBalance_j.
/// Source  as HandPassivityController; the damper of an admittance port
/// Thread  room: no allocation, no throw
class ToolPassivityController {
 public:
  static constexpr double kInitialCredit_j = 5e-3;  ///< what the coupling may store before the hand's first report
  /// A tool that does not act gives its hand nothing to work against, so the balance must recover by itself.
  static constexpr double kLeakRate_w = 2e-3;
  static constexpr double kMinBalance_j = -0.05;
  static constexpr double kMaxBalance_j = 2.0;
  static constexpr double kStepsAhead = 4.0;  ///< n
  static constexpr double kPayBack_s = 0.002;
  static constexpr double kSlow_m_per_s = 0.02;
  static constexpr double kLever_m = 0.03;
  static constexpr double kGentleBrake_n_s_per_m = 20;
  static constexpr double kGentleUpTo_j = 0.02;
  static constexpr double kFirmBrake_n_s_per_m = 2000;

  /// The client's running sums, for every input that came; `elapsed_s` since the one before.
  /// In      could_do_j  the most that a hand can have done since then, on the way that its handle took
  void hand_reported(double from_hand_j, double to_hand_j, double elapsed_s,
                     double could_do_j = std::numeric_limits<double>::infinity()) noexcept;
  /// After a step: where the tool is, what the coupling with its brake did on it, and the world's running sum of what
  /// this user put in less what he drew (its own, so trusted).
  void stepped(const Pose& X_WT, const Wrench& on_tool_W, double net_into_world_j) noexcept;
  /// Of the coming step [N·s/m], 0 … kFirmBrake_n_s_per_m.
  /// In      acts  the tool touches or holds something. What touches nothing gives the world nothing: a brake there would
  ///               pay nothing back, and hold the tool in the air
  double brake_n_s_per_m(double step_s, bool acts = true) noexcept;
  /// The handle starts somewhere else than the last one ended, or than the tool is, without a motion along which its
  /// hand could have done work: a negative balance is cleared, and what the coupling stores is credited.
  void restart_handle(double stored_j) noexcept;
  /// A new user, or a new session of the same.
  void reset() noexcept { *this = ToolPassivityController(); }

  double balance_j() const noexcept { return balance_j_; }
  std::uint64_t limited_steps() const noexcept { return limited_steps_; }
  std::uint64_t dropped_reports() const noexcept { return hand_.dropped(); }

 private:
  void add_to_balance(double energy_j) noexcept;

  EnergyReport hand_;
  PortLookAhead port_;
  Wrench on_tool_W_;
  double net_into_world_j_ = 0;
  double balance_j_ = 0;
  double brake_n_s_per_m_ = 0;
  double idle_s_ = 0;  ///< since the tool touched something
  std::uint64_t limited_steps_ = 0;
};

}  // namespace tandem::haptics
