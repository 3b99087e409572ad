// Tables of numbers as files, for whoever analyses: CSV, and HDF5 with all of them.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Names and rows; a NaN is an empty cell. Numbers read back to the same bits.
/// Fails   std::runtime_error: the file cannot be written
void write_csv(const std::filesystem::path& file, const CsvTable& table);

/// A group for each table, a dataset for each of its columns; `about` are attributes of the file.
/// Fails   std::runtime_error: the file cannot be written
void write_tables_hdf5(const std::filesystem::path& file, const std::map<std::string, CsvTable>& tables,
                       const std::map<std::string, std::string>& about);

}  // namespace tandem::lab
