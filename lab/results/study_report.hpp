// Results of a study as an HTML report. Its first page compares the stages at the longest delay for which there are
// results. Its appendix has a figure and a definition of each metric. A figure shows the metric as a function of the
// delay, with the spread over the seeds.
#pragma once

#include <span>

#include "lab/report/html_report.hpp"
#include "lab/results/trial_runner.hpp"

namespace tandem::lab {

/// Returns the report. It contains no date or host data, so the same results give the same bytes.
HtmlReport study_report(std::span<const TrialResult> results);
/// Adds the results of a study to another report: figures and tables of each experiment, and definitions of the
/// metrics.
void add_study(HtmlReport& page, std::span<const TrialResult> results);

/// Axis of the figures of one metric. Quantity and unit follow from the suffix of the metric's name. `factor` converts
/// the metric's SI value to that unit.
struct MetricAxis {
  PlotAxis axis;
  double factor = 1;
};
MetricAxis axis_of_metric(std::string_view metric);

/// Returns the name of a trial's curve over the delay: stage, settings of the client, jitter and loss. Trials that
/// differ only in delay and seed have the same name.
std::string curve_of(const boost::json::object& row);

}  // namespace tandem::lab
