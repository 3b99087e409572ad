// Results of a study for programs (results.json, results.csv) and for a terminal.
#pragma once

#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "common/base/json.hpp"
#include "lab/metrics/touch_errors.hpp"
#include "lab/results/trial_runner.hpp"

namespace tandem::lab {

/// Returns {"trials": [...]} without data of the host or run time, so the same study gives the same bytes.
boost::json::object study_json(std::span<const TrialResult> results);
/// Returns one line for each trial, without the fields of single users.
std::string study_csv(std::span<const TrialResult> results);
/// Returns the wall-clock time of the study and of each trial.
boost::json::object study_timing_json(std::span<const TrialResult> results, double wall_s);

/// Returns a number of a row; NaN if it is null or missing.
double number_in(const boost::json::object& row, std::string_view name);
std::string text_in(const boost::json::object& row, std::string_view name);

/// Whether a user's link was silent for longer than kLongSilence_ms. The stage is not responsible for that trial's
/// outcome.
bool was_silent(const boost::json::object& row);

/// Rows of trials that differ only in their seed, at least one. Trials with a long silence form separate groups.
using SeedGroup = std::vector<const boost::json::object*>;
/// Mean over the seeds; NaN if all values are null.
double mean_of(const SeedGroup& group, std::string_view name);
/// Worst value of the seeds (worst_value()). Fails: std::invalid_argument for an unknown metric
double worst_of(const SeedGroup& group, std::string_view name);
/// Outcomes without repetition: "completed", "completed 4/dropped 1".
std::string outcomes_of(const SeedGroup& group);
/// Groups the trials by seed, in the order of their first trials.
std::vector<SeedGroup> seed_groups(std::span<const TrialResult> results);

/// Prints one line for every group, and a second one with the worst values if it has several seeds.
void print_study(std::ostream& out, std::span<const TrialResult> results);
/// Whether a user lost its connection, or never got one, in any trial.
bool has_lost_users(std::span<const TrialResult> results);

}  // namespace tandem::lab
