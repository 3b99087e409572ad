// Results of a study as one HTML page. It contains the definition of each metric, and plots each metric over the delay
// for each stage.
#pragma once

#include <span>
#include <string>

#include "lab/results/trial_runner.hpp"

namespace tandem::lab {

/// Returns the page. The same results give the same bytes.
std::string study_report_html(std::span<const TrialResult> results);

}  // namespace tandem::lab
