// Checks the header of an EDF, EDF+, BDF or BDF+ file before EDFlib reads the file.
#pragma once

#include <cstdint>
#include <filesystem>

namespace tandem::eeg {

/// Maximum number of samples in a file, summed over its signals. 14 channels at 128 Hz reach this number in 20 hours.
inline constexpr std::uint64_t kMaxFileSamples = std::uint64_t{1} << 27U;

/// Checks that the numbers of the header are valid and consistent, and that they agree with the size of the file.
/// EDFlib also refuses wrong headers, but its message does not name the wrong field.
///
/// Source  Kemp, Olivan, "European data format 'plus' (EDF+)", Clinical Neurophysiology 114, 2003; the BDF+ description
/// Fails   std::invalid_argument: the message names the file, the field, its value and the remedy
void check_edf_header(const std::filesystem::path& file);

}  // namespace tandem::eeg
