// Passivity controller of a tool's port, at the server. The tool may put into the world only the reported
// energy input of its hand and the energy that it took from the world before. A stage whose tool merely follows a late
// pose reports no energy of its hand.
#pragma once

#include <cstdint>
#include <limits>

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/energy_report.hpp"
#include "common/haptics/passivity/port_look_ahead.hpp"

namespace tandem::haptics {

/// Damps the things that a user's pull moves, by as much as energy is missing for the next step.
///
/// Model   energy balance E = (Σ from_hand − Σ to_hand, as reported) − (Σ into_world − Σ from_world, as measured, after
///         the brake). The missing energy is D = n max(0, m) − E − initial credit where that is above 0; m is the work
///         of the coming step if the tool moves on as before. D is dissipated within kPayBack_s: b = D / (kPayBack_s
///         u²), u the tool's speed and its turning at kLever_m, at least kSlow_m_per_s. The brake changes gradually.
///         Its bound is kGentleBrake_n_s_per_m while at most kGentleUpTo_j is missing, then rises linearly to
///         kFirmBrake_n_s_per_m at the least balance. A firm brake shakes a thing that two users squeeze between them.
///         The room applies b to everything that acts for the user (World::brake()). A brake does nothing at rest, so a
///         held or pressed thing stays so. If the client's model is too light, its hand does too little work: the thing
///         then feels heavier to move, but is not dropped.
///         Pose and energy travel in one message, so the delay by itself makes no negative balance: the tool's present
///         motion answers a handle whose energy arrived with it. Where inputs are played out, their energies are played
///         out with them.
///         A negative balance recovers at kLeakRate_w and is bounded by kMinBalance_j. E falls while the hand receives
///         energy that it put in itself; limiting that is the task of HandPassivityController.
/// Limits  m uses the last step's wrench: a wrench that grows within a step (first contact) overdraws once, and is
///         braked afterwards. A pull of 6 N without any supply creeps at 3 mm/s once the balance is at its least.
///         Energy dissipated on the hand's side stays in the balance up to kMaxBalance_j.
/// Source  see HandPassivityController; the damper of an admittance port
/// Thread  room: no allocation, no throw
class ToolPassivityController {
 public:
  static constexpr double kInitialCredit_j = 5e-3;  ///< energy that the coupling may store before the first report
  /// Recovery rate of a negative balance: a tool that does not act gives its hand nothing to work against.
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

  /// Adds the client's running sums, once for every received input; `elapsed_s` since the previous one.
  /// In      could_do_j  upper bound of the hand's work since then along the path of its handle
  void hand_reported(double from_hand_j, double to_hand_j, double elapsed_s,
                     double could_do_j = std::numeric_limits<double>::infinity()) noexcept;
  /// Ends a step.
  /// In      on_tool_W  wrench of the coupling and its brake on the tool
  ///         net_into_world_j  running sum of this user's net input; computed by the server, so trusted
  void stepped(const Pose& X_WT, const Wrench& on_tool_W, double net_into_world_j) noexcept;
  /// Returns the brake of the coming step [N·s/m], 0 … kFirmBrake_n_s_per_m.
  /// In      acts  the tool touches or holds something. Otherwise the tool gives the world no energy: a brake would
  ///         dissipate nothing and hold the tool in the air
  double brake_n_s_per_m(double step_s, bool acts = true) noexcept;
  /// Handles a jump of the handle, relative to its last pose or to the tool, without a motion along which the hand
  /// could have done work. Clears a negative balance and credits the energy stored in the coupling.
  void restart_handle(double stored_j) noexcept;
  /// Starts a new user, or a new session of the same user.
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
  double idle_s_ = 0;  ///< time since the tool touched something
  std::uint64_t limited_steps_ = 0;
};

}  // namespace tandem::haptics
