// Metrics that compare stages. Each is one function, named in the table of trial_metrics.cpp; an entry there also
// appears in results, reports and their definitions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// One user of a trial and its references; null if there is none.
struct UserView {
  const Experiment& experiment;
  const UserTrace& user;
  const UserTrace* reference;   ///< the same hand at zero delay on the reference stage: the truth
  const UserTrace* same_stage;  ///< the same hand at zero delay on the user's own stage
};

/// A trial and the runs of the same hands at zero delay.
struct TrialView {
  const Experiment& experiment;
  const SessionTrace& trace;
  const SessionTrace* reference = nullptr;
  const SessionTrace* same_stage = nullptr;
};

/// Combination of the values of several users into that of the trial. Users for whom a metric is undefined do not
/// count.
enum class Combine { kGreatest, kLeast, kMean, kSum, kFarthestFromOne };
std::string_view name_of(Combine combine);

/// One metric: computed for each user and then combined, or for the trial as a whole. NaN if undefined.
struct TrialMetric {
  std::string_view name;        ///< key in results.json, including the unit
  std::string_view definition;  ///< text in the report
  Combine combine = Combine::kGreatest;
  double (*of_user)(const UserView&) = nullptr;
  double (*of_trial)(const TrialView&) = nullptr;
};
const std::vector<TrialMetric>& trial_metrics();
/// Fails: std::invalid_argument for an unknown name.
const TrialMetric& trial_metric_called(std::string_view name);
/// Worst value of a metric over several trials, by its way to combine users; for a sum the greatest. NaN if neither end
/// is worse (a mean of users), or without a value.
double worst_value(const TrialMetric& metric, const std::vector<double>& values);

UserView view_of_user(const TrialView& trial, std::size_t user);
double value_of(const TrialMetric& metric, const TrialView& trial);
/// Value of the metric with this name. Fails: std::invalid_argument for an unknown name.
double trial_metric(const TrialView& trial, std::string_view name);

}  // namespace tandem::lab
