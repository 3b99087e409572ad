// Runs the trials of a study: on all cores, each once, and none that is already there.
//
//   OUT/trials/KEY.json    what a finished trial leaves; KEY is the hash of everything that decides its outcome
//   OUT/samples/KEY/…      its time series, where they were asked for
//
// A trial's file appears whole or not at all, so a study that was interrupted goes on where it was. Threads share only
// what does not change (scenes, and runs at zero delay once they are done); the results are in the order of the trials,
// whatever the threads do.
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
  bool wants_samples = false;           ///< time series of every trial …
  bool samples_lie_in_out = false;      ///< … of the only one, in `out` itself
  bool holds_against_own_stage = true;  ///< and not against the truth alone: the metrics of TrialView::same_stage
  std::string program;                  ///< that runs them: another one's trials are not reused
};

struct TrialResult {
  boost::json::object row;  ///< a line of results.json
  std::string key;
  std::filesystem::path samples;  ///< folder with the time series; "": none
  double virtual_s = 0;
  double wall_s = 0;
  bool was_there = false;
};

/// What has to be done, before it is.
struct StudySize {
  std::size_t trials = 0;
  std::size_t references = 0;  ///< runs at zero delay
  std::size_t there = 0;       ///< trials that are done already
  double virtual_s = 0;        ///< of all runs that are to be done
};

class TrialRunner {
 public:
  /// Loads the scenes.
  /// Fails   SceneError, std::invalid_argument
  TrialRunner(std::vector<Trial> trials, RunSettings settings, const server::SceneLoading& loading = {});
  ~TrialRunner();

  StudySize size() const;
  /// Results in the order of the trials. Called once.
  /// In      on_progress  called after each trial with how many are done, and how many of them were there already
  /// Fails   the first failure of a run, after the others have stopped; what is finished stays
  std::vector<TrialResult> run(const std::function<void(std::size_t done, std::size_t reused)>& on_progress);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What the trial was and what came out. Numbers that have no meaning are null.
boost::json::object trial_row(const Trial& trial, const TrialView& view);

/// SHA-256 of the running program's file, in hex: two builds are two programs.
std::string program_fingerprint();

}  // namespace tandem::lab
