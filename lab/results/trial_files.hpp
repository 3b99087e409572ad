// Files with the time series of one trial.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "client/app/trace.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/report/html_report.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Writes the files of a trial. During the trial, it writes a time series N-NAME.csv for user number N. At the end it
/// writes bodies.csv, the report and, as the last file, trial.json (results.hpp). Therefore a folder that contains
/// trial.json is complete.
class TrialFiles {
 public:
  /// Creates the folder.
  /// Fails   std::invalid_argument: the folder or a file cannot be created
  TrialFiles(const Experiment& experiment, const std::filesystem::path& folder);

  void write_tick(std::size_t user, const client::TickRecord& record, int phase) {
    traces_[user]->write(record, phase);
  }
  /// Writes bodies.csv, the report and trial.json.
  /// Fails   std::runtime_error: a file could not be written
  void finish(const SessionTrace& trace, const std::string& key, const HtmlReport& report);

 private:
  const Experiment& experiment_;
  std::filesystem::path folder_;
  std::vector<std::unique_ptr<client::TraceWriter>> traces_;
};

/// Returns whether the folder contains all files of the trial with this key (a hash of the trial's inputs).
bool has_trial_files(const std::filesystem::path& folder, const std::string& key);

}  // namespace tandem::lab
