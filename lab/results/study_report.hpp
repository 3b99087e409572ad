// The results of a study as one HTML page: what each metric is, and how every stage fares with growing delay.
#pragma once

#include <span>
#include <string>

#include "lab/results/trial_runner.hpp"

namespace tandem::lab {

/// The same bytes for the same results.
std::string study_report_html(std::span<const TrialResult> results);

}  // namespace tandem::lab
