// Reads EEG from the lab streaming layer (LSL) through the library liblsl, which the user must have installed.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "devices/eeg/sources/eeg_source.hpp"

namespace tandem::eeg {

struct LslSettings {
  std::filesystem::path library;  ///< file of liblsl; empty: the search path of the system is used
  std::string stream;             ///< name of the stream; empty: the first stream of the type EEG
  Duration found_within = std::chrono::seconds(10);
  Duration silent_for = std::chrono::seconds(5);  ///< time without a sample after which the stream counts as lost
};

/// Opens a stream. The names and units of its channels are read from its description. A channel without a unit is
/// assumed to be in microvolts.
/// Fails   std::runtime_error: liblsl is missing, no stream is found, or its description is not usable; the message
///         names the remedy
std::unique_ptr<EegSource> open_lsl(const LslSettings& settings);

}  // namespace tandem::eeg
