// Passivity controller of a tool's port, at the server. The tool may supply energy to the world from two sources only:
// the work that the client reports for the user's hand, and energy that the tool received from the world before. In
// stages whose tool merely follows a delayed pose, the client reports no work of the hand.
#pragma once

#include <cstdint>
#include <limits>

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/energy_report.hpp"
#include "common/haptics/passivity/port_look_ahead.hpp"

namespace tandem::haptics {

/// Brakes the bodies that a user's coupling moves. The damping dissipates the energy that the balance lacks for the
/// next step.
///
/// Model   Energy balance: E = (Σ from_hand − Σ to_hand, as reported) − (Σ into_world − Σ from_world, as measured,
///         after the brake). E falls while the hand receives back energy that it supplied; HandPassivityController
///         limits this energy. A negative E recovers at kLeakRate_w and is bounded by kMinBalance_j.
///         Missing energy: D = max(0, n max(0, m) − E − initial credit), where m is the work of the coming step if the
///         tool repeats its last motion, and n is kStepsAhead.
///         Brake: a damper with the coefficient b = D / (kPayBack_s u²) dissipates D within kPayBack_s. u is the tool's
///         speed including its rotation at kLever_m, at least kSlow_m_per_s. b changes gradually.
///         Upper limit of b: kGentleBrake_n_s_per_m while D is at most kGentleUpTo_j. With a larger D, the limit rises
///         linearly, up to kFirmBrake_n_s_per_m at the minimum balance. A firm brake shakes a body that two users
///         squeeze between them, so it is used only if much energy is missing.
///         Effect: the room applies b to all bodies that act for the user (World::brake()). A brake has no effect at
///         rest, so a held or pressed body stays where it is. If the bodies in the client's local model are too light,
///         the hand does too little work. The carried body then feels heavier, but is not dropped.
///         Delay: pose and energy travel in one message, so the energy for each handle pose arrives together with this
///         pose. Therefore delay alone makes no balance negative. If inputs pass through a playout buffer, so do their
///         energies.
/// Limits  * m uses the wrench of the last step. A wrench that grows within a step (first contact) exceeds the balance
///           once and is braked in the next step.
///         * A pull of 6 N without any energy supply creeps at 3 mm/s when the balance is at its minimum.
///         * Energy dissipated on the hand's side stays in the balance, up to kMaxBalance_j.
/// Source  as for HandPassivityController; the brake is the damper of an admittance port
/// Thread  room: no allocation, no throw
class ToolPassivityController {
 public:
  static constexpr double kInitialCredit_j = 5e-3;  ///< energy that the coupling may store before the first report
  /// Recovery rate of a negative balance. Without recovery, a tool that the brake stopped would remain stopped: the
  /// user's hand feels no force there and thus does no work.
  static constexpr double kLeakRate_w = 2e-3;
  static constexpr double kMinBalance_j = -0.05;
  static constexpr double kMaxBalance_j = 2.0;
  static constexpr double kStepsAhead = 4.0;  ///< n, number of steps that the energy balance must cover
  /// Constants of the brake, see Model.
  static constexpr double kPayBack_s = 0.002;
  static constexpr double kSlow_m_per_s = 0.02;
  static constexpr double kLever_m = 0.03;
  static constexpr double kGentleBrake_n_s_per_m = 20;
  static constexpr double kGentleUpTo_j = 0.02;
  static constexpr double kFirmBrake_n_s_per_m = 2000;

  /// Adds the energy that the client reports as running sums. Call it once for each received input; `elapsed_s` is the
  /// time since the previous one.
  /// In      could_do_j  upper bound of the hand's work since the previous input, along the path of the handle
  void hand_reported(double from_hand_j, double to_hand_j, double elapsed_s,
                     double could_do_j = std::numeric_limits<double>::infinity()) noexcept;
  /// Ends a step.
  /// In      on_tool_W  wrench of the coupling and its brake on the tool
  ///         net_into_world_j  running sum of this user's net energy input. The server computes it, so it is not
  ///         checked against any limit
  void stepped(const Pose& X_WT, const Wrench& on_tool_W, double net_into_world_j) noexcept;
  /// Returns the brake of the coming step [N·s/m], 0 to kFirmBrake_n_s_per_m.
  /// In      acts  whether the tool touches or holds a body. If not, the tool supplies no energy to the world. The
  ///         brake is then released, because it would only resist motion in free space
  double brake_n_s_per_m(double step_s, bool acts = true) noexcept;
  /// Handles a jump of the handle's pose: clears a negative balance, and credits the energy stored in the coupling
  /// after the jump. The hand did no work along the jump.
  void restart_handle(double stored_j) noexcept;
  /// Restarts for a new user, or for a new session of the same user.
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
  double idle_s_ = 0;  ///< time since the tool last touched something
  std::uint64_t limited_steps_ = 0;
};

}  // namespace tandem::haptics
