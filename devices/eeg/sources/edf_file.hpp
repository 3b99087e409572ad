// EDF+ and BDF+ files through EDFlib.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "devices/eeg/recording.hpp"

namespace tandem::eeg {

/// One signal as the file contains it.
struct EdfSignal {
  std::string name;
  std::string unit;
  int samples_per_record = 0;
  int digital_min = 0, digital_max = 0;
  double physical_min = 0, physical_max = 0;
  std::vector<std::int32_t> digital;  ///< exact values of the converter

  double physical(std::int32_t value) const;
};

struct EdfContent {
  bool is_bdf = false;
  double record_s = 1;  ///< duration of a data record
  std::vector<EdfSignal> signals;
  std::vector<Annotation> annotations;
};

/// Reads a file completely, with all its signals and annotations.
/// Fails   std::invalid_argument: the message names the file, the field, the value and the remedy
EdfContent read_edf(const std::filesystem::path& file);

/// Writes EDF+ (16 bits) or BDF+ (24 bits), without a name or a date of a person. All signals have the same number of
/// records; a record lasts `record_s`.
/// Fails   std::invalid_argument: the content does not fit the format, or the file exists or cannot be written
void write_edf(const std::filesystem::path& file, const EdfContent& content);

/// Reads the EEG of a file, in microvolts.
///
/// In      channels  names of the channels in the order of use; empty: all whose unit is a voltage
/// Fails   std::invalid_argument: a channel is missing or not a voltage, or the rates differ
Recording read_recording(const std::filesystem::path& file, const std::vector<std::string>& channels);

/// Returns microvolts per unit for uV, mV, nV and V; 0 for other units.
double microvolts_per(const std::string& unit);

}  // namespace tandem::eeg
