// Writes the results of a study as one HDF5 file, for analysis in Python, MATLAB or R. It contains:
//
//   /trials/0000   attributes: experiment, stage, …, seed, overrides (JSON), outcome, and every metric (null becomes
//                  NaN)
//   /trials/0000/users/NAME          attributes: metrics of this user
//   /trials/0000/samples/1-anna/t_s  a dataset for each column of the time series, if they were stored
#pragma once

#include <filesystem>
#include <span>

#include "lab/results/trial_runner.hpp"

namespace tandem::lab {

/// Writes the results of all trials to `file`.
/// Fails   std::runtime_error: the file cannot be written
void write_study_hdf5(const std::filesystem::path& file, std::span<const TrialResult> results);

}  // namespace tandem::lab
