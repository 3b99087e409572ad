// The hand's end of a user's energy account, live: the hand may have what it put in itself, what the server says was
// drawn from the world for this user, and what the client's own local copies gave; no more, whatever the delay and
// whatever computed the wrench. A safety net: it should seldom act, and says how much it took.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/energy_report.hpp"

namespace tandem::haptics {

/// Time-domain passivity observer and controller of the hand's port.
///
/// Model   account E = −Σ (F_j·(x_{j+1} − x_j) + τ_j·θ_{j,j+1}) + C_world + C_local, F, τ as displayed and held; C of a
///         source is the most that its net gift (given − got) has been so far, at least 0. The next period can take at
///         most m = |F| (δ + a T²) + |τ| (δ_θ + α T²), δ the last period's step, whichever way the hand turns. The
///         wrench is scaled by g = min(1, (E + allowance) / (n m)), which falls at once and rises slowly, so that
///         neither end of an action is a kick.
///         Why it holds: n ≥ 1, so no period takes more than E + allowance: the hand never gets more than
///         C_world + C_local + allowance beyond what it put in.
///         Why only the rise of a gift counts: what the tool got of the hand's energy would else be charged twice, here
///         and by the scaling that keeps it from getting more (ToolPortGuard), and the force would not come back.
///         World, wire and local copy: each sum only grows, so loss of a report delays a credit and does no harm.
/// Source  Hannaford, Ryu, "Time-domain passivity control of haptic interfaces", IEEE T-RA 18(1), 2002; theirs looks
///         back and adds damping, ours looks one period ahead and scales. Two-port accounts over a delay: Ryu, Artigas,
///         Preusche, "A passive bilateral control scheme for a teleoperator with time-varying communication delay",
///         Mechatronics 20(7), 2010; they let each port give only what came in at the other, ours also what came in
///         here
/// Limits  What dampers and friction took stays in the account up to account_limit_j, so a limit cycle after long work
///         is not bounded by it before that is spent. A hand that accelerates more than stated overdraws by |F| times
///         the excess, once. Poses are those of the encoder.
/// Thread  haptic: no allocation, no throw; output finite for any input
class GuardedPort {
 public:
  struct Settings {
    /// What may be missing: 0 would refuse the first touch. A hand that leaves a spring k at speed v is not noticed
    /// when it is above k (n (v T + a T²))² / 2: 1000 N/m at 0.2 m/s. A fifth of what is promised never to be created.
    double allowance_j = 2e-4;
    double account_limit_j = 2.0;  ///< dissipation leaves no more licence than this
    double credit_limit_w = 20.0;  ///< reports are believed no faster: ten times what a hand does at 6.5 N and 0.3 m/s
    double periods_ahead = 2.0;    ///< n: more is softer, and acts sooner
    double rise_s = 0.05;          ///< of g from 0 to 1
    /// Of the loop. A tick that came late does not make the next one as long, and of what the hand took meanwhile only
    /// this much of the time is charged: nobody could have foreseen it, and a debt would never be paid with no force
    /// left.
    double period_s = 0.001;
    double acceleration_m_per_s2 = 100;  ///< the most that the speed of hand and device can change by
    double acceleration_rad_per_s2 = 5000;
  };
  explicit GuardedPort(const Settings& settings) : settings_(settings), world_(settings.credit_limit_w) {}

  /// The server's running sums, for every update that came; `elapsed_s` since the one before.
  void world_reported(double from_world_j, double into_world_j, double elapsed_s) noexcept;
  /// The local model's running net gift (StageOutput::energy_from_local_j); trusted, but not when it is not finite. The
  /// first one only sets where to count from.
  void local_gave(double net_j) noexcept;
  /// What may be displayed until the next tick.
  /// In      X_WH  of the hand, without clutch; on_hand_W  about the handle
  /// Fails   zero for a pose, wrench or period that is not finite; the account is kept
  Wrench apply(const Pose& X_WH, const Wrench& on_hand_W, double period_s) noexcept;
  /// What was really displayed, when later stages changed it.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  /// Where the hand is, is not known: the stretch to the next apply() is left out.
  void lose_hand() noexcept { has_pose_ = false; }
  void reset() noexcept;

  double account_j() const noexcept { return account_j_; }
  /// Σ over periods of what the scaled-away part of the wrench would have given the hand, ≥ 0.
  double withheld_j() const noexcept { return withheld_j_; }
  /// Σ |work| of the displayed wrench.
  double exchanged_j() const noexcept { return exchanged_j_; }
  std::uint64_t acted_ticks() const noexcept { return acted_ticks_; }
  std::uint64_t dropped_reports() const noexcept { return world_.dropped(); }
  /// g of the last apply().
  double gain() const noexcept { return gain_; }

 private:
  /// Credits the rise of a source's net gift above its highest so far.
  class Gift {
   public:
    double add(double net_j) noexcept;

   private:
    double lent_j_ = 0;
  };
  void end_period(const Pose& X_WH, double period_s) noexcept;
  void credit(double energy_j) noexcept;
  double most_of_next_period_j(const Wrench& on_hand_W) const noexcept;

  Settings settings_;
  EnergyReport world_;
  Gift world_gift_;
  Gift local_gift_;
  double local_net_j_ = 0;
  bool has_local_ = false;
  bool has_pose_ = false;
  Pose X_WH_;
  double step_m_ = 0;
  double turn_rad_ = 0;
  Wrench displayed_;
  Wrench kept_back_;  ///< of the period that runs
  Wrench spared_;     ///< likewise, by later stages
  double gain_ = 1;
  double account_j_ = 0;
  double withheld_j_ = 0;
  double exchanged_j_ = 0;
  std::uint64_t acted_ticks_ = 0;
};

}  // namespace tandem::haptics
