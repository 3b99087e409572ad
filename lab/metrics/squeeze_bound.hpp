// How hard two hands can squeeze a thing between them over a network, at most.
#pragma once

#include "lab/metrics/trial_metrics.hpp"

namespace tandem::lab {

/// The weaker user's mean force in the settled hold, if the joints between the copies of what they squeeze were as
/// stiff as passivity lets them be [N]. NaN where it has no meaning: not two users of a local model, a body is held,
/// there is no run at zero delay, or hands do not push against each other in it.
///
/// Model   Between the places where two hands want to be there are springs in a row, of each user: hand k_h, coupling
///         k_c, joint k_j from the client's copy to the server's body. (In rest both ends of a joint are stretched
///         alike and bear the same force, so it counts once.) The squeezing force is that part of both users' forces
///         which cancels, f = (F_a − F_b)/2, and is the overlap δ of their intentions over the sum of compliances; the
///         rest bears the weight and stays. So
///           f(T) = f(0) · (C + Σ 1/k_j(0)) / (C + Σ 1/k_j(T)),  C = Σ (1/k_h + 1/k_c)
///         A spring whose far end is told T late gives back up to k T of negative damping; the joint's damper b along
///         the pressing direction is what it has to take that, so it is passive by itself for k_j ≤ b/T, T half the
///         round trip. f(0) is measured in the run at zero delay, whose own joints are DelayedJoint::joint(); T is the
///         link's alone, without jitter and the waiting that it costs, so what is measured lies lower.
/// Limits  a bound of this joint with its damper: a stiffer damper would allow more, until it rings by itself
///         (delayed_joint.hpp). The hands' own damping is not counted: with it a little more than b/T can be calm
double hold_force_bound_n(const TrialView& trial);

}  // namespace tandem::lab
