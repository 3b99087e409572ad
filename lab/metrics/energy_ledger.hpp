// Energy that a trial created: energy received by the hands minus energy given by the server's world for the same
// inputs.
#pragma once

#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Energies in world joules.
struct EnergyLedger {
  double created_max_j = 0;          ///< maximum of E(t); 0 or more, since E(0) = 0
  double created_in_100_ms_j = 0;    ///< maximum rise of E(t) within 100 ms
  double created_in_1_s_j = 0;       ///< maximum rise of E(t) within 1 s
  std::vector<double> hand_ports_j;  ///< for each user at the end: work done on the hand; negative if it gave energy
  /// Work that ramp, decay in silence, slew limit and clamp removed; included in E, not in the ports.
  double withheld_by_safety_j = 0;
};

/// Computes the energy balance of a trial.
///
/// Model   E(t) = Σ_users [W(k(t)) + T(t)]
///         k(t)  the last input that the server's world had used at t
///         W(k)  Σ_{j<k} F_j·(x_{j+1} − x_j). F_j is the wrench requested at tick j, after the passivity controller,
///               held until the next tick; x is the true pose of the hand. The part that safety stages and clamp
///               remove is a separate sum: else a hand that leans on a wall through a silence would seem to receive
///               the energy of sinking in
///         T(t)  energy that the user's coupling at the server has put into the world, less the energy that it took
///               from there, plus the energy stored in its spring
///         Both terms are for the same inputs, so no energy is in transit between them. The server's world creates no
///         energy (tests of common/physics). So E > 0 means that the hands got more energy than anything gave, by
///         sampling, delay, prediction, or a model that differs from the server's world. An erroneous force counts
///         with its sign, whether the hand recovers the energy later or not.
/// Source  the two-port observer of Ryu, Artigas, Preusche, "A passive bilateral control scheme for a teleoperator with
///         time-varying communication delay", Mechatronics 20(7), 2010; with the sum over the held force, because the
///         backward sum hides the energy that sampling creates
/// Limits  energy dissipated by the coupling's damper at the server hides an equal amount of created energy
/// Cost    O(ticks)
EnergyLedger energy_ledger(const SessionTrace& trace);

/// Energy that a display would create if it showed every hand of `truth` the right wrench, but late by one loop of
/// `trial`.
///
/// Model   the greatest rise of Σ_users Σ_j [F(j − n) − F(j)]·(x_{j+1} − x_j), F and x of `truth`
///         n  the mean of that user's loop in ticks: from a motion of the hand to the step that uses it, and from a
///            step to the hand
/// Source  δF v τ, summed along the path: the energy of a force with the error of its change within τ
/// Limits  motion of the own hand that a local model predicts also counts as late
/// Out     world joules; 0 or more
double late_energy_j(const SessionTrace& truth, const SessionTrace& trial);

}  // namespace tandem::lab
