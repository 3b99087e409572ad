// Whether a trial did what it was to do.
#pragma once

#include <string>

#include "lab/metrics/trial_metrics.hpp"

namespace tandem::lab {

/// A user who is shown less of the reference's force than this, in the phases in contact, does not feel it.
inline constexpr double kMinForceRatio = 0.5;

/// "completed"; "lost": a user lost its connection. With a rule also "never-lifted": the body never got as high as it
/// should; "dropped": it was not that high at some instant of the rule's phase; or "missed": it did not end where it
/// should. "weak": none of these, but a user's contact_force_ratio is below kMinForceRatio: no force is calm, too.
std::string outcome_of(const TrialView& view);

}  // namespace tandem::lab
