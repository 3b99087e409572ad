// Runs the trials of a study on all cores, each once, and reuses finished trials.
//
//   OUT/trials/KEY.json    result of a finished trial; KEY is the hash of everything that determines its outcome
//   OUT/samples/KEY/…      its time series, if requested
//
// The file of a trial is written completely or not at all, so an interrupted study can be continued. Threads share only
// immutable data (scenes, and finished runs at zero delay). Results are in the order of the trials, regardless of
// thread timing.
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
  std::filesystem::path out;            ///< an existing folder
  std::size_t threads = 1;              ///< 1 or more
  bool keeps_samples = false;           ///< write the time series of every trial …
  bool samples_lie_in_out = false;      ///< … or of the only trial, in `out` itself
  bool holds_against_own_stage = true;  ///< also compute the metrics of TrialView::same_stage
  std::string program;                  ///< fingerprint of this program; results of other programs are not reused
};

struct TrialResult {
  boost::json::object row;  ///< line of results.json
  std::string key;
  std::filesystem::path samples;  ///< folder with the time series; "" if there are none
  double virtual_s = 0;
  double wall_s = 0;
  bool was_done = false;
};

/// Amount of work of a study, known before it starts.
struct StudySize {
  std::size_t trials = 0;
  std::size_t references = 0;  ///< runs at zero delay
  std::size_t done = 0;        ///< trials that are already done
  double virtual_s = 0;        ///< virtual time of all remaining runs
};

class TrialRunner {
 public:
  /// Loads the scenes.
  /// Fails   SceneError, std::invalid_argument
  TrialRunner(std::vector<Trial> trials, RunSettings settings, const server::SceneLoading& loading = {});
  ~TrialRunner();

  StudySize size() const;
  /// Runs all trials and returns the results in their order. Called once.
  /// In      on_progress  called after each trial with the number of finished trials, and the number of reused ones
  /// Fails   the first failure of a run, after the others have stopped; finished trials are kept
  std::vector<TrialResult> run(const std::function<void(std::size_t done, std::size_t reused)>& on_progress);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Row with the parameters and the results of the trial. Undefined numbers are null.
boost::json::object trial_row(const Trial& trial, const TrialView& view);

/// SHA-256 of the running program's file, in hex. Two builds count as different programs.
std::string program_fingerprint();

}  // namespace tandem::lab
