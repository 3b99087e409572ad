// Converts a recording to tables of time series.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Returns the tables of a recording by name. Each has two columns of time: t_s is the time since the first message,
/// and unix_s the time since 1970.
///
/// Out     room    `steps` (every step), `bodies` and `tools` (every recorded state), `inputs` (each input that a step
///         used, with its user and tick)
///         client  `ticks` (every tick, with the columns of the client's --trace file), `link`
/// Fails   see read_recording()
std::map<std::string, CsvTable> recording_tables(const std::filesystem::path& file);

}  // namespace tandem::lab
