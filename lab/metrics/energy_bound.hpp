// How much energy a stage that closes its loop through the network can have made in a trial, at most: what the energy
// created is printed beside.
#pragma once

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Bound of EnergyLedger::created_max_j from what crossed the two ends of each user's line [world J]. NaN where it does
/// not hold: a user of a local model (whose own line is in its ledger), a deadband (the server's handle goes on by
/// itself), a room that held a tool back, or no record of what the server answered (a live trial).
///
/// Model   Work goes into the hand as Σ F_k·Δx_k, and into the server's world, through the handle of the coupling
///         there, as −Σ A_i·Δh_i: F the wrench asked for, x the hand; A_i the server's wrench on the hand in the step
///         that took input i, h_i that input's handle. World, coupling, contact and friction are passive, so what they
///         hold rises by no more than the second sum, and
///           E ≤ Σ_i |Σ_{k from i to i+1} F_k·Δx_k − A_i·Δh_i| + Σ_i ½ (k_t |Δp_i|² + k_r |Δθ_i|²)
///               + max_i Σ |F_k·Δx_k|.
///         First sum: the hand is shown another force than the world answers to that same movement, which is all that
///         delay, hold and extrapolation do; without any of them it is rounding. Second: a handle that jumps from one
///         input to the next loads the coupling by half its stiffness times the jump squared more than A_i says. Third:
///         of inputs on their way at an instant the world has not seen anything; the most that they carried.
///         wave: waves carry what they were given and no more, whatever the delay (common/haptics/wave), so 0
/// Limits  effects that give energy (common/physics/effects), and what a molecular field gives by being sampled, are not in
///         it; k_t, k_r are the scene's, not an adapted law's
/// Source  the two-port observer of Ryu, Artigas, Preusche, "A passive bilateral control scheme for a teleoperator with
///         time-varying communication delay", Mechatronics 20(7), 2010, with the parts of its sum taken without sign
/// Cost    O(ticks)
double energy_created_bound_j(const SessionTrace& trace);

}  // namespace tandem::lab
