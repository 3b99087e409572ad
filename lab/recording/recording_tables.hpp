// The time series of a recording as tables.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Tables of a room: `steps` (every step), `bodies` and `tools` (every recorded state), `inputs` (each input that a
/// step used, with its user and tick). Tables of a client: `ticks`, with the columns of its --trace, and `link`. Times
/// t_s count from the first message; unix_s is since 1970.
///
/// Fails   see read_recording()
std::map<std::string, CsvTable> recording_tables(const std::filesystem::path& file);

}  // namespace tandem::lab
