// The results of a study for programs (results.json, results.csv) and for a terminal.
#pragma once

#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "common/base/json.hpp"
#include "lab/metrics/touch_errors.hpp"
#include "lab/results/trial_runner.hpp"

namespace tandem::lab {

/// {"trials": [...]}: nothing of the host or of the time that it took, so that the same study gives the same bytes.
boost::json::object study_json(std::span<const TrialResult> results);
/// One line a trial, without what is of single users.
std::string study_csv(std::span<const TrialResult> results);
/// How long it took: of the whole and of each trial.
boost::json::object study_timing_json(std::span<const TrialResult> results, double wall_s);

/// A number of a row; NaN where it is null or missing.
double number_in(const boost::json::object& row, std::string_view name);
std::string text_in(const boost::json::object& row, std::string_view name);

/// Whether a user's link was silent for longer than kLongSilence_ms: what came of it is no matter of the stage.
bool was_silent(const boost::json::object& row);

/// Rows of trials that differ in nothing but their seed, at least one; those with a long silence apart from the others.
using SeedGroup = std::vector<const boost::json::object*>;
/// Mean over the seeds; NaN when all are null.
double mean_of(const SeedGroup& group, std::string_view name);
/// The worst of the seeds (worst_value()). Fails: std::invalid_argument for what is no metric
double worst_of(const SeedGroup& group, std::string_view name);
/// Outcomes, each once: "completed", "completed 4/dropped 1".
std::string outcomes_of(const SeedGroup& group);
/// In the order of their first trials.
std::vector<SeedGroup> seed_groups(std::span<const TrialResult> results);

/// One line for every group of seeds; a second with the worst where there are several.
void print_study(std::ostream& out, std::span<const TrialResult> results);
/// Whether a user lost its connection, or never got one, in any trial.
bool has_lost_users(std::span<const TrialResult> results);

}  // namespace tandem::lab
