// Reads the motion of the hand from a recording, for the device "replay".
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "devices/device.hpp"

namespace tandem::client {

/// Reads the device samples of a client's recorded ticks, from all files of the recording.
/// Out     why  reason why the recording is incomplete, for the user; empty: it is complete. The `reason` of the last
///              sample before the damage contains the same text
/// Fails   std::invalid_argument: not a client's recording, or it has more than 2 million ticks
std::shared_ptr<const std::vector<devices::DeviceSample>> read_recorded_hand(const std::filesystem::path& file,
                                                                             std::string& why);

}  // namespace tandem::client
