// Energy that a trial created: the energy that the hands received, minus the energy that the server's world supplied
// for the same inputs.
#pragma once

#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Energies in world joules. E(t) is defined at energy_ledger().
struct EnergyLedger {
  double created_max_j = 0;        ///< maximum of E(t); 0 or more, since E(0) = 0
  double created_in_100_ms_j = 0;  ///< maximum rise of E(t) within 100 ms
  double created_in_1_s_j = 0;     ///< maximum rise of E(t) within 1 s
  /// for each user: work done on the hand until the end of the trial; negative if the hand supplied energy
  std::vector<double> hand_ports_j;
  /// Energy that the safety stages withheld from the hands: start ramp, decay during a silence, slew limit and clamp.
  /// It is included in E but not in `hand_ports_j`.
  double withheld_by_safety_j = 0;
};

/// Computes the energy balance of a trial.
///
/// Model   E(t) = Σ_users [W(k(t)) + T(t)]
///         k(t)  the last input that the server's world had used at time t
///         W(k)  Σ_{j<k} F_j·(x_{j+1} − x_j). F_j is the wrench requested at tick j, after the passivity controller,
///               held until the next tick; x is the true pose of the hand. The part that the safety stages and the
///               clamp remove is summed separately. Otherwise a hand that leans on a wall during a silence would seem
///               to receive the energy of sinking in
///         T(t)  energy that the user's coupling at the server has put into the world, minus the energy that it has
///               taken from the world, plus the energy stored in its spring
///         Both terms refer to the same inputs, so no energy is in transit between them. The server's world creates no
///         energy (tests of common/physics). Therefore E > 0 means that the hands received more energy than was
///         supplied. The causes are sampling, delay, prediction, or a model that differs from the server's world. The
///         work of an erroneous force counts with its sign, even if the hand later recovers that energy.
/// Source  the two-port observer of Ryu, Artigas, Preusche, "A passive bilateral control scheme for a teleoperator with
///         time-varying communication delay", Mechatronics 20(7), 2010. We sum over the held force, because the
///         backward sum does not include the energy that sampling creates
/// Limits  energy dissipated by the coupling's damper at the server hides an equal amount of created energy
/// Cost    O(ticks)
EnergyLedger energy_ledger(const SessionTrace& trace);

/// Returns the energy that a display would create if it rendered the correct wrench of every hand of `truth`, but
/// delayed by one loop of `trial`.
///
/// Model   the largest rise of Σ_users Σ_j [F(j − n) − F(j)]·(x_{j+1} − x_j); F and x are those of `truth`
///         n  mean loop delay of the user in ticks: from a motion of the hand to the step that uses it, plus from a
///            step to the hand
/// Source  δF v τ, summed along the path: a delay τ causes a force error of the change of F within τ, which does work
///         on the motion
/// Limits  motion of the user's own hand also counts as late, although a local model can predict it
/// Out     world joules; 0 or more
double late_energy_j(const SessionTrace& truth, const SessionTrace& trial);

}  // namespace tandem::lab
