// The report.html of a trial: diagrams of each hand's touch over virtual time. It depends only on the trace, so that
// the same trial gives the same bytes.
#pragma once

#include <string>

#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Returns one HTML file that needs no network access.
std::string trial_report_html(const Experiment& experiment, const SessionTrace& trace);

}  // namespace tandem::lab
