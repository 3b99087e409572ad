// The numbers that stages are compared by. Each is one function named in the table of trial_metrics.cpp; adding one
// there puts it into results, reports and their definitions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// One user of a trial and the same hand at zero delay.
struct UserView {
  const Experiment& experiment;
  const UserTrace& user;
  const UserTrace* reference;  ///< null: there is none
};

/// A trial and the same hands at zero delay.
struct TrialView {
  const Experiment& experiment;
  const SessionTrace& trace;
  const SessionTrace* reference = nullptr;
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

UserView view_of_user(const TrialView& trial, std::size_t user);
double value_of(const TrialMetric& metric, const TrialView& trial);
/// By name. Fails: std::invalid_argument for an unknown one.
double trial_metric(const TrialView& trial, std::string_view name);

/// Phases of a hand's path in which it is in contact: those, except the ways there and back ("approach", "move",
/// "retreat"), in which the displayed force of the run at zero delay (without one: this run's) is kContactForce_n or
/// more on average.
inline constexpr double kContactForce_n = 0.1;
std::vector<bool> contact_phases(const UserView& view);

/// "completed"; "lost": a user lost its connection. With a rule also "never-lifted": the body never got as high as it
/// should; "dropped": it was not that high at some instant of the rule's phase; or "missed": it did not end where it
/// should.
std::string outcome_of(const Experiment& experiment, const SessionTrace& trace);

}  // namespace tandem::lab
