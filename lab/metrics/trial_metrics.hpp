// The numbers that stages are compared by. Each is one function named in the table of trial_metrics.cpp; adding one
// there puts it into results, reports and their definitions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// One user of a trial and what it is held against; null: there is none.
struct UserView {
  const Experiment& experiment;
  const UserTrace& user;
  const UserTrace* reference;   ///< the same hand at zero delay on the reference stage: the truth
  const UserTrace* same_stage;  ///< the same hand at zero delay on the user's own stage
};

/// A trial and the same hands at zero delay.
struct TrialView {
  const Experiment& experiment;
  const SessionTrace& trace;
  const SessionTrace* reference = nullptr;
  const SessionTrace* same_stage = nullptr;
};

/// How the values of several users become the trial's; users for whom a metric has no meaning do not count.
enum class Combine { kGreatest, kLeast, kMean, kSum, kFarthestFromOne };
std::string_view name_of(Combine combine);

/// One metric: of each user, then combined, or of the trial as a whole. NaN: it has no meaning there.
struct TrialMetric {
  std::string_view name;        ///< as in results.json, unit included
  std::string_view definition;  ///< as in the report
  Combine combine = Combine::kGreatest;
  double (*of_user)(const UserView&) = nullptr;
  double (*of_trial)(const TrialView&) = nullptr;
};
const std::vector<TrialMetric>& trial_metrics();
/// Fails: std::invalid_argument for an unknown name.
const TrialMetric& trial_metric_called(std::string_view name);
/// The worst of several trials' values of a metric, which is how users are combined; of a sum the greatest. NaN where
/// neither end is the worse (a mean of users), or without a value.
double worst_value(const TrialMetric& metric, const std::vector<double>& values);

UserView view_of_user(const TrialView& trial, std::size_t user);
double value_of(const TrialMetric& metric, const TrialView& trial);
/// By name. Fails: std::invalid_argument for an unknown one.
double trial_metric(const TrialView& trial, std::string_view name);

}  // namespace tandem::lab
