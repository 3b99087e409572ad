// Force series of other programs: CSV files in our own format, and .traj files of the haptic data repository.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Reads every force (and torque) column of a file and resamples it at an even rate: `.traj` by the name's extension,
/// else CSV with a column t_s or time_s.
///
/// .traj   lines of numbers separated by blanks: time, position x y z, force x y z, then anything; lines that begin
/// with #, % or a letter are skipped. README.md lists the known and the assumed parts of this format.
/// In      rate_hz      rate of the linearly resampled series
///         time_unit_s  unit of the file's times: 0.001 for milliseconds
///         columns      columns of a CSV file, separated by commas; "": all whose names end in _n or _n_m
/// Fails   std::invalid_argument naming the file, the line, the error and the remedy
CsvTable load_series(const std::filesystem::path& file, double rate_hz = 200, double time_unit_s = 1,
                     const std::string& columns = "");
CsvTable parse_traj(std::string_view text, const std::string& origin, double rate_hz = 200, double time_unit_s = 1);

}  // namespace tandem::lab
