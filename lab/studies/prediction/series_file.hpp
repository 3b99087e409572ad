// Reads force series from files: CSV files in the format of lab/report/csv.hpp, and .traj files of the haptic data
// repository.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Reads every force and torque column of a file and resamples it at a constant rate. A file with the extension `.traj`
/// is read in that format; any other file as CSV with a column t_s or time_s.
///
/// A .traj file has lines of numbers separated by spaces: time, position x y z, force x y z, and further numbers, which
/// are ignored. Lines that begin with #, % or a letter are skipped. README.md states which parts of this format are
/// known and which are assumed.
/// In      rate_hz      rate of the linearly resampled series
///         time_unit_s  unit of the times in the file [s], e.g. 0.001 for milliseconds
///         columns      columns of a CSV file, separated by commas; empty: all columns whose names end in _n or _n_m
/// Fails   std::invalid_argument naming the file, the line, the error and the remedy
CsvTable load_series(const std::filesystem::path& file, double rate_hz = 200, double time_unit_s = 1,
                     const std::string& columns = "");
CsvTable parse_traj(std::string_view text, const std::string& origin, double rate_hz = 200, double time_unit_s = 1);

}  // namespace tandem::lab
