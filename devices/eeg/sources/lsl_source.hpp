// EEG from the lab streaming layer (LSL), through the library liblsl that the user has installed.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "devices/eeg/sources/eeg_source.hpp"

namespace tandem::eeg {

struct LslSettings {
  std::filesystem::path library;  ///< file of liblsl; empty: the one that the system finds
  std::string stream;             ///< name of the stream; empty: the first of the type EEG
  Duration found_within = std::chrono::seconds(10);
  Duration silent_for = std::chrono::seconds(5);  ///< without a sample the stream counts as lost
};

/// Opens a stream. Names and units of its channels are those of its description; a unit that is missing is taken as
/// microvolts.
/// Fails   std::runtime_error: liblsl is missing, no stream is found, or its description is not usable; the message
///         names the remedy
std::unique_ptr<EegSource> open_lsl(const LslSettings& settings);

}  // namespace tandem::eeg
