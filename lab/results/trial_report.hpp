// The report of a trial: figures of force, motion and energy of each hand over time. Another run of the same hands is
// drawn for comparison. The report depends only on the traces, so that the same trial gives the same bytes.
#pragma once

#include <string>
#include <vector>

#include "lab/experiment/experiment.hpp"
#include "lab/report/html_report.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Another run of the same hands, drawn together with a trial.
struct ComparedTrace {
  const SessionTrace* trace = nullptr;
  std::string name;  ///< name in the legend
};

/// Returns the page of a trial in virtual time. `reference` is the trace of the same hands at zero delay; null if there
/// is none.
HtmlReport trial_report(const Experiment& experiment, const SessionTrace& trace, const SessionTrace* reference);

/// Returns the figures of a trial. The first is the force on the hands.
std::vector<Plot> trial_figures(const Experiment& experiment, const SessionTrace& trace, const ComparedTrace& other);
/// Adds a table of the users, and a table of their metrics.
void add_trial_tables(HtmlReport& page, const SessionTrace& trace);

}  // namespace tandem::lab
