// Outcome of a trial: whether the users fulfilled their task.
#pragma once

#include <string>

#include "lab/metrics/trial_metrics.hpp"

namespace tandem::lab {

/// Smallest contact force that a user still feels, as a fraction of the contact force in the reference. Below it, the
/// outcome is "weak".
inline constexpr double kMinForceRatio = 0.5;

/// Returns the outcome of a trial: the first in this list that applies.
///   "lost"          a user lost the connection
///   "never-lifted"  the body never reached the height that the rule requires
///   "dropped"       the body was below that height at some time in the rule's phase
///   "missed"        the final position of the body was wrong
///   "weak"          the contact_force_ratio of a user is below kMinForceRatio. Without this outcome, a stage that
///                   displays no force would count as stable
///   "completed"     otherwise
std::string outcome_of(const TrialView& view);

}  // namespace tandem::lab
