// Results of a study as files for programs (results.json, results.csv) and as text for a terminal.
#pragma once

#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "common/base/json.hpp"
#include "lab/metrics/touch_errors.hpp"
#include "lab/results/trial_runner.hpp"

namespace tandem::lab {

/// Returns {"trials": [...]}. The result contains neither host data nor run times, so that the same study gives the
/// same bytes.
boost::json::object study_json(std::span<const TrialResult> results);
/// Returns one line for each trial. Values of single users are omitted.
std::string study_csv(std::span<const TrialResult> results);
/// Returns the wall-clock time of the whole study and of each trial.
boost::json::object study_timing_json(std::span<const TrialResult> results, double wall_s);

/// Returns a number of a row, or NaN if it is null or missing.
double number_in(const boost::json::object& row, std::string_view name);
std::string text_in(const boost::json::object& row, std::string_view name);

/// Returns whether a user's link was silent for longer than kLongSilence_ms. During such a silence every stage must let
/// the force decay. Therefore the outcome of the trial does not depend on the stage.
bool was_silent(const boost::json::object& row);

/// Rows of one or more trials that differ only in their seed. Trials with a long silence form separate groups.
using SeedGroup = std::vector<const boost::json::object*>;
/// Returns the mean over the seeds, or NaN if all values are null.
double mean_of(const SeedGroup& group, std::string_view name);
/// Returns the worst value over the seeds; see worst_value(). Fails: std::invalid_argument for an unknown metric.
double worst_of(const SeedGroup& group, std::string_view name);
/// Returns the distinct outcomes with their counts: "completed", "completed 4/dropped 1".
std::string outcomes_of(const SeedGroup& group);
/// Groups the trials that differ only in their seed. The groups are in the order of their first trials.
std::vector<SeedGroup> seed_groups(std::span<const TrialResult> results);

/// Prints one line for each group. A second line with the worst values follows if the group has several seeds.
void print_study(std::ostream& out, std::span<const TrialResult> results);
/// Returns whether any user of any trial lost the connection or never obtained one.
bool has_lost_users(std::span<const TrialResult> results);

}  // namespace tandem::lab
