// Reads and writes EDF+ and BDF+ files with EDFlib.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "devices/eeg/recording.hpp"

namespace tandem::eeg {

/// One signal of a file: its integers as stored in the file, and the scale that converts them to physical values.
struct EdfSignal {
  std::string name;
  std::string unit;
  int samples_per_record = 0;
  int digital_min = 0, digital_max = 0;
  double physical_min = 0, physical_max = 0;
  std::vector<std::int32_t> digital;  ///< values of the analog-to-digital converter

  double physical(std::int32_t value) const;
};

struct EdfContent {
  bool is_bdf = false;
  double record_s = 1;  ///< duration of a data record; a file is a sequence of data records
  std::vector<EdfSignal> signals;
  std::vector<Annotation> annotations;
};

/// Reads all signals and annotations of a file.
/// Fails   std::invalid_argument: the message names the file, the field, the value and the remedy
EdfContent read_edf(const std::filesystem::path& file);

/// Writes an EDF+ file (16 bits) or a BDF+ file (24 bits). The header contains neither a person's name nor the date.
/// All signals must have the same number of records.
/// Fails   std::invalid_argument: the content does not fit the format, or the file exists or cannot be written
void write_edf(const std::filesystem::path& file, const EdfContent& content);

/// Reads the EEG channels of a file, converted to microvolts.
///
/// In      channels  names of the channels to read, in this order; empty: all channels with a voltage as unit
/// Fails   std::invalid_argument: a channel is missing or not a voltage, or the rates differ
Recording read_recording(const std::filesystem::path& file, const std::vector<std::string>& channels);

/// Returns the number of microvolts per unit for the units uV, mV, nV and V; 0 for other units.
double microvolts_per(const std::string& unit);

}  // namespace tandem::eeg
