// Converts the time series of a recording to tables.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Returns the tables of a recording. A room has `steps` (every step), `bodies` and `tools` (every recorded state) and
/// `inputs` (each input that a step used, with its user and tick). A client has `ticks`, with the columns of its
/// --trace, and `link`. The time t_s counts from the first message; unix_s counts from 1970.
///
/// Fails   see read_recording()
std::map<std::string, CsvTable> recording_tables(const std::filesystem::path& file);

}  // namespace tandem::lab
