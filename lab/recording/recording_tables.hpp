// The time series of a recording as tables.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Of a room: `steps` (each), `bodies` and `tools` (as often as they were recorded), `inputs` (each that a step took, by user and
/// tick). Of a client: `ticks`, with the columns of its --trace, and `link`. Times t_s count from the first message;
/// unix_s is since 1970.
///
/// Fails   as read_recording()
std::map<std::string, CsvTable> recording_tables(const std::filesystem::path& file);

}  // namespace tandem::lab
