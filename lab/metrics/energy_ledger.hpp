// Where the energy of a trial went: what the hands were given and what is held on their behalf, at every step.
#pragma once

#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Energies in world joules.
struct EnergyLedger {
  double created_max_j = 0;          ///< the greatest of E(t); 0 or more, for E(0) = 0
  double created_in_100_ms_j = 0;    ///< the greatest rise of E(t) + J(t) within so long
  double created_in_1_s_j = 0;       ///< likewise
  double stored_change_j = 0;        ///< of S and of all models, at the end
  double corrected_j = 0;            ///< what corrections of the models towards the server put in; part of the above
  std::vector<double> hand_ports_j;  ///< of each user at the end: work done on the hand, less than 0 when it gave
  /// Work that ramp, decay in silence, slew limit and clamp left out; in E, not in the ports.
  double withheld_by_safety_j = 0;
};

/// Balances a trial.
///
/// Model   E(t) = Σ_users [Σ_k F_k·(x_{k+1} − x_k) + M(t) − M(0)] + U(t) + S(t) − S(0)
///         F_k  wrench asked for at tick k, after the passivity controller, held until the next; x  true pose of the
///              hand. What safety stages and clamp leave out of it is a line of its own: else a hand that leans on a
///              wall through a silence would seem to be given what it sank in by
///         M    of a user of a local model: what the model holds, less what came into it from elsewhere than the hand
///              (ModelLedger: bodies that changed their owner there, the field). Corrections towards the server are not
///              taken off: what they give a hand was created
///         U    of the field between molecules, which M is without. Each user has his own late view of it, so it has no
///              one value at an instant. W is its work on the molecules that local models step, W_s what the field at
///              the server has lost:  U = max(0, W − depth) − max(0, W_s − W). Hands that get more out of it, turn by turn,
///              than its well is deep (field_depth_j()), got that from the delay; what it gave at the server reaches
///              hands by corrections, and is not from nowhere
///         S    of what is at the server:
///              + for users of a local model, the work that joints to their copies did on bodies there. A shared body
///                and its copy are two things with a joint between; what one end loses the other should get. What the
///                joint stores is in neither, so it lowers E while it is there
///              + for users of other stages, who touch the server's world itself, all that it stores, less what users
///                of a local model did to it. A thing that such a user alone touches is at the server only as a late copy
///                of what is in M already; counted too, it would be energy that a hand has got back and the copy
///                still has
///         J    what joints between a shared body and its copies hold: the mean of what both ends say, for each has a
///              late view of the other. It is not in E, which it would make rise while something is squeezed and nothing
///              was created; but a rise within a short time would else be what a joint only gave back
///         Whatever friction, dampers and passivity controllers take makes E fall, so E > 0 means that energy came from
///         nowhere: from sampling, from delay, or from a model that is not the server's.
/// Source  Hannaford, Ryu, "Time-domain passivity control of haptic interfaces", IEEE T-RA 18(1), 2002: the observer;
///         with the sum over the held force, for the backward sum hides what sampling creates
/// Limits  For stages other than the local model, what is in flight between hand and world is in neither: a force that
///         the hand has given and the world has not yet felt makes E fall first, so a surplus shows as late as the
///         delay; and what the world has felt and the hand not yet makes E rise for so long. What contacts store is
///         not counted. In a trial that mixes stages, a body that hangs in a local model's hand has its weight in M and
///         in S.
/// Cost    O(ticks)
EnergyLedger energy_ledger(const SessionTrace& trace);

}  // namespace tandem::lab
