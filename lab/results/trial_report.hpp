// report.html of a trial: the touch of each hand over virtual time. It depends only on the trace, so the same trial
// gives the same bytes.
#pragma once

#include <string>

#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// One HTML file, readable without network.
std::string trial_report_html(const Experiment& experiment, const SessionTrace& trace);

}  // namespace tandem::lab
