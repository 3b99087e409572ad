// Checks the header of an EDF, EDF+, BDF or BDF+ file before EDFlib reads the file.
#pragma once

#include <cstdint>
#include <filesystem>

namespace tandem::eeg {

/// Most samples of all signals of a file; 14 channels at 128 Hz reach it in 20 hours.
inline constexpr std::uint64_t kMaxFileSamples = std::uint64_t{1} << 27U;

/// Checks each number of the header, its relations, and the size of the file. EDFlib also refuses wrong headers, but
/// does not name the field.
///
/// Source  Kemp, Olivan, "European data format 'plus' (EDF+)", Clinical Neurophysiology 114, 2003; the BDF+ description
/// Fails   std::invalid_argument: the message names the file, the field, its value and the remedy
void check_edf_header(const std::filesystem::path& file);

}  // namespace tandem::eeg
