// Outcome of a trial: whether it fulfilled its task.
#pragma once

#include <string>

#include "lab/metrics/trial_metrics.hpp"

namespace tandem::lab {

/// Least share of the reference's contact force that counts as felt, in the phases in contact.
inline constexpr double kMinForceRatio = 0.5;

/// Returns "completed", or "lost" if a user lost its connection. A rule also gives "never-lifted": the body did not
/// reach the required height; "dropped": it was below that height at some time in the rule's phase; "missed": it did
/// not end at the required position. "weak": none of these, but the contact_force_ratio of a user is below
/// kMinForceRatio. Without this a zero force would count as calm.
std::string outcome_of(const TrialView& view);

}  // namespace tandem::lab
