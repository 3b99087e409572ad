// Outcome of a trial: whether the users fulfilled their task.
#pragma once

#include <string>

#include "lab/metrics/trial_metrics.hpp"

namespace tandem::lab {

/// Smallest permitted ratio of a user's contact force to the contact force in the reference. With a smaller ratio, the
/// outcome of the trial is "weak".
inline constexpr double kMinForceRatio = 0.5;

/// Returns the outcome of a trial. If several entries of this list apply, it is the first one. "lost" a user lost the
///   connection "never-lifted" the body never reached the height that the rule requires "dropped" the body was below
///   that height at some time in the rule's phase "missed" the final position of the body was wrong "weak" the metric
///   contact_force_ratio of a user is below kMinForceRatio. Without this rule, a stage that displays no force would
///   succeed "completed" otherwise
std::string outcome_of(const TrialView& view);

}  // namespace tandem::lab
