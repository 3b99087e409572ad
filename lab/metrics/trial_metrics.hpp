// Metrics that compare stages. Each metric is one function, listed in the table of trial_metrics.cpp. A metric in that
// table also appears in results and reports, with its definition.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// One user of a trial and its references. A pointer is null if that reference does not exist.
struct UserView {
  const Experiment& experiment;
  const UserTrace& user;
  const UserTrace* reference;   ///< trace of the same hand at zero delay on the reference stage
  const UserTrace* same_stage;  ///< trace of the same hand at zero delay on the user's own stage
};

/// A trial and its references, which are runs of the same hands at zero delay.
struct TrialView {
  const Experiment& experiment;
  const SessionTrace& trace;
  const SessionTrace* reference = nullptr;
  const SessionTrace* same_stage = nullptr;
};

/// Rule that combines the values of all users into one value of the trial. Users for whom a metric is undefined are
/// ignored.
enum class Combine { kGreatest, kLeast, kMean, kSum, kFarthestFromOne };
std::string_view name_of(Combine combine);

/// One metric. It is computed either for each user and then combined, or for the trial as a whole. NaN means undefined.
struct TrialMetric {
  std::string_view name;        ///< key in results.json, including the unit
  std::string_view definition;  ///< definition that the report prints
  Combine combine = Combine::kGreatest;
  double (*of_user)(const UserView&) = nullptr;
  double (*of_trial)(const TrialView&) = nullptr;
};
const std::vector<TrialMetric>& trial_metrics();
/// Returns the metric with this name. Fails: std::invalid_argument for an unknown name.
const TrialMetric& trial_metric_called(std::string_view name);
/// Returns the worst value of a metric over several trials. The metric's rule for combining users (`combine`) defines
/// which value is worst: for kLeast the smallest, for kFarthestFromOne the one farthest from 1, for kGreatest and kSum
/// the largest. The result is NaN for kMean, which has no worst value, or if there are no values.
double worst_value(const TrialMetric& metric, const std::vector<double>& values);

UserView view_of_user(const TrialView& trial, std::size_t user);
double value_of(const TrialMetric& metric, const TrialView& trial);
/// Returns the value of the metric with this name. Fails: std::invalid_argument for an unknown name.
double trial_metric(const TrialView& trial, std::string_view name);

}  // namespace tandem::lab
