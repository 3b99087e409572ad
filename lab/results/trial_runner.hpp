// Runs each trial of a study once, in parallel on all cores, and reuses the results of finished trials.
//
//   OUT/trials/KEY.json    result of a finished trial; KEY is the hash of everything that determines its outcome
//   OUT/samples/KEY/…      time series of the trial, if requested
//
// The file of a trial is either complete or absent, so that an interrupted study can be continued. Threads share only
// immutable data: scenes, and finished runs at zero delay. The results are in the order of the trials; they do not
// depend on the timing of the threads.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/json.hpp"
#include "lab/experiment/trial_grid.hpp"
#include "lab/metrics/trial_metrics.hpp"

namespace tandem::lab {

struct RunSettings {
  std::filesystem::path out;        ///< folder for the results; it must exist
  std::size_t threads = 1;          ///< number of threads; at least 1
  bool keeps_samples = false;       ///< whether the time series of every trial are written
  bool samples_lie_in_out = false;  ///< whether the time series are written directly to `out` (single trial)
  /// whether each trial is also run at zero delay on its own stage, for metrics that compare with this run
  /// (TrialView::same_stage)
  bool holds_against_own_stage = true;
  /// hash that identifies this program (program_fingerprint()); results of a different program are not reused
  std::string program;
};

struct TrialResult {
  boost::json::object row;  ///< row of the trial in results.json
  std::string key;
  std::filesystem::path samples;  ///< folder with the time series; empty if there are none
  double virtual_s = 0;
  double wall_s = 0;
  bool was_done = false;
};

/// Amount of work of a study, known before the study starts.
struct StudySize {
  std::size_t trials = 0;
  std::size_t references = 0;  ///< number of runs at zero delay
  std::size_t done = 0;        ///< number of trials whose results already exist
  double virtual_s = 0;        ///< total virtual time of all runs that remain
};

class TrialRunner {
 public:
  /// Loads the scenes.
  /// Fails   see load_experiment_scene()
  TrialRunner(std::vector<Trial> trials, RunSettings settings, const server::SceneLoading& loading = {});
  ~TrialRunner();

  StudySize size() const;
  /// Runs all trials and returns the results in the order of the trials. May be called only once.
  /// In      on_progress  called after each trial with the numbers of finished and of reused trials
  /// Fails   rethrows the first exception of a run after the other threads have stopped; the results of finished trials
  ///         are stored
  std::vector<TrialResult> run(const std::function<void(std::size_t done, std::size_t reused)>& on_progress);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the row of a trial in results.json: parameters and metrics. Undefined numbers are null.
boost::json::object trial_row(const Trial& trial, const TrialView& view);

/// Returns the SHA-256 hash of the running program's file, in hexadecimal. Two builds count as different programs.
std::string program_fingerprint();

}  // namespace tandem::lab
