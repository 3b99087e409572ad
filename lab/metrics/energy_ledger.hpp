// Whether a trial made energy: what hands got against what the server's world gave for the same inputs.
#pragma once

#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Energies in world joules.
struct EnergyLedger {
  double created_max_j = 0;          ///< the greatest of E(t); 0 or more, for E(0) = 0
  double created_in_100_ms_j = 0;    ///< the greatest rise of E(t) within so long
  double created_in_1_s_j = 0;       ///< likewise
  std::vector<double> hand_ports_j;  ///< of each user at the end: work done on the hand, less than 0 when it gave
  /// Work that ramp, decay in silence, slew limit and clamp left out; in E, not in the ports.
  double withheld_by_safety_j = 0;
};

/// Balances a trial.
///
/// Model   E(t) = Σ_users [W(k(t)) + T(t)]
///         k(t)  the input that the server's world had used by then
///         W(k)  Σ_{j<k} F_j·(x_{j+1} − x_j), F_j the wrench asked for at tick j, after the passivity controller, held
///               until the next; x the true pose of the hand. What safety stages and clamp leave out of it is a line of
///               its own: else a hand that leans on a wall through a silence would seem to be given what it sank in by
///         T(t)  what the user's coupling at the server has put into the world, less what it took from there, with
///               what its spring holds
///         Both are of the same inputs, so nothing is on its way between them. The server's world makes nothing by
///         itself (tests of common/physics), so E > 0 means that hands got more than anything gave: from sampling, from
///         delay, from prediction, or from a model that is not the server's world. A force that is wrong where it is felt
///         counts with its sign, whether a hand gets it back later or not.
/// Source  the two-port observer of Ryu, Artigas, Preusche, "A passive bilateral control scheme for a teleoperator with
///         time-varying communication delay", Mechatronics 20(7), 2010; with the sum over the held force, for the
///         backward sum hides what sampling creates
/// Limits  what the coupling's damper takes at the server covers as much that is made
/// Cost    O(ticks)
EnergyLedger energy_ledger(const SessionTrace& trace);

/// What a display would make that shows every hand of `truth` the right wrench, but one loop of `trial` late.
///
/// Model   the greatest rise of Σ_users Σ_j [F(j − n) − F(j)]·(x_{j+1} − x_j), F and x of `truth`
///         n  the mean of that user's loop in ticks: from a hand's motion to the step that uses it, and from a step to the hand
/// Source  δF v τ, summed along the path: the energy of a force that errs by what it changes within τ
/// Limits  what a local model foresees of its own hand is counted as if it came late
/// Out     world joules; 0 or more
double late_energy_j(const SessionTrace& truth, const SessionTrace& trial);

}  // namespace tandem::lab
