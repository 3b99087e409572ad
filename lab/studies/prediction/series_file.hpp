// Force series of other programs: CSV files as ours write them, and .traj files of the haptic data repository.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Every force (and torque) column of a file, at the even rate that is asked for: `.traj` by its name, else CSV with a
/// column t_s or time_s.
///
/// .traj   lines of numbers between blanks: time, position x y z, force x y z, anything more; lines that begin with #,
///         % or a letter are skipped. README.md says what of this is known and what is assumed.
/// In      rate_hz      that the series are resampled to, by straight lines
///         time_unit_s  of the file's times: 0.001 for milliseconds
///         columns      of a CSV file, separated by commas; "": all that end in _n or _n_m
/// Fails   std::invalid_argument naming file, line, what is wrong and the remedy
CsvTable load_series(const std::filesystem::path& file, double rate_hz = 200, double time_unit_s = 1,
                     const std::string& columns = "");
CsvTable parse_traj(std::string_view text, const std::string& origin, double rate_hz = 200, double time_unit_s = 1);

}  // namespace tandem::lab
