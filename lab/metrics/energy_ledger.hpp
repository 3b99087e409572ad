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
  /// Energy that the safety stages withheld from the hands. The stages are start ramp, decay during a silence of the
  /// link, slew limit and clamp. E counts this energy as if the hands had received it; `hand_ports_j` does not.
  double withheld_by_safety_j = 0;
};

/// Computes the energy balance of a trial.
///
/// Model   E(t) = Σ_users [W(k(t)) + T(t)] k(t) number of the newest input that the server's world has used up to time
///         t W(k) Σ_{j<k} F_j·(x_{j+1} − x_j): work on the hand until tick k. x_j is the true pose of the hand at tick
///         j. F_j is the wrench requested at tick j (after the passivity controller, before the safety stages and the
///         clamp); it is held until the next tick. The effect of the safety stages is summed separately. Otherwise a
///         hand that sinks into a wall during a silence would seem to receive energy T(t) energy that the user's
///         coupling at the server has put into the world, minus the energy that it has taken from the world, plus the
///         energy stored in its spring W and T refer to the same inputs, so no energy is in transit between hand and
///         server. The server's world creates no energy (tests of common/physics). Therefore E > 0 means that the hands
///         received more energy than the world supplied. Possible causes are sampling, delay, prediction, and a local
///         model that differs from the server's world.
/// Source  the two-port observer of Ryu, Artigas, Preusche, "A passive bilateral control scheme for a teleoperator with
///         time-varying communication delay", Mechatronics 20(7), 2010. We sum over the held force, because the
///         backward sum does not include the energy that sampling creates Limits the coupling's damper at the server
///         dissipates energy, and E does not show created energy up to this amount
/// Cost    O(ticks)
EnergyLedger energy_ledger(const SessionTrace& trace);

/// Returns the energy that a display would create if it rendered the correct wrenches of `truth`, but late by the mean
/// loop delay of `trial`.
///
/// Model   the largest rise of Σ_users Σ_j [F(j − n) − F(j)]·(x_{j+1} − x_j)
///         * F(j), x_j: displayed wrench and true pose of the hand at tick j in the trace `truth`
///         * n: mean loop delay of the user in `trial` [ticks]. It is the mean time from a motion of the hand until the
///           server's step that uses it, plus the mean time from a step until its state is used at the hand
/// Source  our derivation: a delay τ causes a force error equal to the change of F within τ. This error does work along
///         the path of the hand Limits the reaction to the user's own motion is also assumed to be late, although a
///         local model can display it without delay
/// Out     world joules; 0 or more
double late_energy_j(const SessionTrace& truth, const SessionTrace& trial);

}  // namespace tandem::lab
