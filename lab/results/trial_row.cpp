// Converts a trial to its row in results.json; see trial_runner.hpp.
#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <string_view>

#include "lab/metrics/outcome.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/results/trial_runner.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

/// Returns the values of all users as one text. Different values are joined with "+"; equal values are listed once.
template <class Of>
std::string of_users(const Experiment& experiment, const Of& of) {
  std::string text;
  std::set<std::string> seen;
  for (const ExperimentUser& user : experiment.users) {
    const std::string word = of(user);
    if (seen.insert(word).second) text.append(text.empty() ? "" : "+").append(word);
  }
  return text;
}

/// Largest round-trip delay [ms], one-way jitter [ms] and loss of all users' links.
struct LinkSummary {
  double rtt_ms = 0;
  double jitter_ms = 0;
  double loss = 0;
};

LinkSummary link_summary(const ExperimentUser& user) {
  const auto in_milliseconds = [](Duration value) { return to_seconds(value) * 1e3; };
  return {in_milliseconds(round_trip_of(user)),
          std::max(in_milliseconds(user.up.jitter), in_milliseconds(user.down.jitter)),
          std::max(user.up.loss, user.down.loss)};
}

LinkSummary link_summary(const Experiment& experiment) {
  LinkSummary result;
  for (const ExperimentUser& user : experiment.users) {
    const LinkSummary own = link_summary(user);
    result.rtt_ms = std::max(result.rtt_ms, own.rtt_ms);
    result.jitter_ms = std::max(result.jitter_ms, own.jitter_ms);
    result.loss = std::max(result.loss, own.loss);
  }
  return result;
}

json::object users_json(const TrialView& view, std::size_t index) {
  const ExperimentUser& user = view.trace.users[index].user;
  const LinkSummary link = link_summary(user);
  json::object result{{"name", user.name},
                      {"stage", user.pipeline.stage},
                      {"rtt_ms", link.rtt_ms},
                      {"jitter_ms", link.jitter_ms},
                      {"loss", link.loss}};
  for (const TrialMetric& metric : trial_metrics()) {
    if (metric.of_user != nullptr) result[metric.name] = metric.of_user(view_of_user(view, index));
  }
  return result;
}

/// Returns the settings of a trial that have no column of their own in the results.
json::object overrides_json(const Trial& trial) {
  constexpr std::array<std::string_view, 7> kColumns{"stage",          "predictor", "passivity", "link.rtt_ms",
                                                     "link.jitter_ms", "link.loss", "seed"};
  json::object result;
  for (const auto& setting : trial.settings) {
    const bool has_column = std::find(kColumns.begin(), kColumns.end(), setting.key()) != kColumns.end();
    if (!has_column) result[setting.key()] = setting.value();
  }
  return result;
}

}  // namespace

json::object trial_row(const Trial& trial, const TrialView& view) {
  const Experiment& experiment = trial.experiment;
  const LinkSummary link = link_summary(experiment);
  json::object row{{"experiment", experiment.name},
                   {"stage", of_users(experiment, [](const auto& user) { return user.pipeline.stage; })},
                   {"predictor", of_users(experiment, [](const auto& user) { return user.pipeline.predictor; })},
                   {"passivity", experiment.controls_passivity()},
                   {"deadband", experiment.pipeline.deadband},
                   {"rtt_ms", link.rtt_ms},
                   {"jitter_ms", link.jitter_ms},
                   {"loss", link.loss},
                   {"seed", experiment.seed},
                   {"overrides", overrides_json(trial)}};
  for (const TrialMetric& metric : trial_metrics()) row[metric.name] = value_of(metric, view);
  row["outcome"] = outcome_of(view);
  json::array& users = row["users"].emplace_array();
  for (std::size_t i = 0; i < view.trace.users.size(); ++i) users.push_back(users_json(view, i));
  return row;
}

}  // namespace tandem::lab
