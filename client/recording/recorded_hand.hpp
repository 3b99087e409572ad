// Reads the motion of the hand from a recording, for the device "replay".
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "devices/device.hpp"

namespace tandem::client {

/// Reads the device samples of a recorded client, from all files of the recording.
/// Out     why  text for the user if the recording is incomplete, otherwise empty. Before a damaged part of the file,
///         the last sample has the same text as its `reason`
/// Fails   std::invalid_argument if the file is not the recording of a client, or if it has more than 2 million ticks
std::shared_ptr<const std::vector<devices::DeviceSample>> read_recorded_hand(const std::filesystem::path& file,
                                                                             std::string& why);

}  // namespace tandem::client
