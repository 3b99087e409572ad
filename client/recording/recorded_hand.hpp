// The hand of a recording, for the device "replay".
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "devices/device.hpp"

namespace tandem::client {

/// Reads the device samples of a client's recorded ticks, from all files of the recording.
/// Out     why  reason why the recording is incomplete, for the user; empty: complete. The `reason` of the last sample
///              before damage states it
/// Fails   std::invalid_argument: not a client's recording, or more than 2 million ticks
std::shared_ptr<const std::vector<devices::DeviceSample>> read_recorded_hand(const std::filesystem::path& file,
                                                                             std::string& why);

}  // namespace tandem::client
