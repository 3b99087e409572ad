// Energy that a trial created: the energy received by the hands, minus the energy supplied by the server's world for
// the same inputs.
#pragma once

#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Energies in world joules (joules in the server's world, before the scaling of force and motion to the hand). E(t) is
/// defined at energy_ledger().
struct EnergyLedger {
  double created_max_j = 0;        ///< maximum of E(t); 0 or more, since E(0) = 0
  double created_in_100_ms_j = 0;  ///< maximum rise of E(t) within 100 ms
  double created_in_1_s_j = 0;     ///< maximum rise of E(t) within 1 s
  /// for each user: work done on the hand until the end of the trial; negative if the hand supplied energy
  std::vector<double> hand_ports_j;
  /// Energy that the safety stages withheld from the hands: start ramp, decay during a silence of the link, slew limit
  /// and clamp. It is included in E but not in `hand_ports_j`.
  double withheld_by_safety_j = 0;
};

/// Computes the energy balance of a trial.
///
/// Model   E(t) = Σ_users [W(k(t)) + T(t)]
///         k(t)  the last input that the server's world had used at time t
///         W(k)  Σ_{j<k} F_j·(x_{j+1} − x_j). F_j is the wrench requested at tick j, after the passivity controller,
///               held until the next tick; x is the true pose of the hand. F_j does not include the effect of the
///               safety stages and the clamp, which is summed separately. Otherwise a hand that sinks into a wall
///               during a silence would seem to receive energy
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

/// Returns the energy that a display would create if it rendered the correct wrenches of `truth`, but late by the mean
/// loop delay of `trial`.
///
/// Model   the largest rise of Σ_users Σ_j [F(j − n) − F(j)]·(x_{j+1} − x_j)
///         * F(j), x_j: requested wrench and pose of the hand at tick j, as in energy_ledger(), in the trace `truth`
///         * n: mean loop delay of the user in ticks. It is the delay from a motion of the hand to the step that uses
///           it, plus the delay from a step to the hand
/// Source  our derivation: a delay τ causes a force error equal to the change of F within τ. This error does work along
///         the path of the hand
/// Limits  the motion of the user's own hand counts as delayed too, although a local model can predict it
/// Out     world joules; 0 or more
double late_energy_j(const SessionTrace& truth, const SessionTrace& trial);

}  // namespace tandem::lab
