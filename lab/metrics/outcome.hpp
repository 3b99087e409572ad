// Outcome of a trial: whether the users fulfilled their task.
#pragma once

#include <string>

#include "lab/metrics/trial_metrics.hpp"

namespace tandem::lab {

/// Smallest contact force, as a share of the contact force in the reference, with which a user still feels the contact.
/// Below it, the outcome is "weak".
inline constexpr double kMinForceRatio = 0.5;

/// Returns "completed", or "lost" if a user lost the connection. A rule may also give "never-lifted" (the body never
/// reached the required height), "dropped" (it was below that height at some time in the rule's phase) or "missed" (its
/// final position was wrong). The result is "weak" if none of these applies but the contact_force_ratio of a user is
/// below kMinForceRatio. Without this rule, a force of zero would be rated as calm.
std::string outcome_of(const TrialView& view);

}  // namespace tandem::lab
