// Files with the time series of one trial.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "client/app/trace.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Writes N-NAME.csv of every user during the trial, and the other files at its end: bodies.csv, report.html, and
/// trial.json (results.hpp) last. So a folder with trial.json is complete.
class TrialFiles {
 public:
  /// Makes the folder.
  /// Fails   std::invalid_argument: folder or file cannot be made
  TrialFiles(const Experiment& experiment, const std::filesystem::path& folder);

  void write_tick(std::size_t user, const client::TickRecord& record, int phase) {
    traces_[user]->write(record, phase);
  }
  /// Fails   std::runtime_error: a file could not be written
  void finish(const SessionTrace& trace, const std::string& key);

 private:
  const Experiment& experiment_;
  std::filesystem::path folder_;
  std::vector<std::unique_ptr<client::TraceWriter>> traces_;
};

/// Whether the folder contains the complete files of the trial with this key.
bool has_trial_files(const std::filesystem::path& folder, const std::string& key);

}  // namespace tandem::lab
