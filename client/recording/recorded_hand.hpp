// The hand of a recording, for the device "replay".
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "devices/device.hpp"

namespace tandem::client {

/// What a client's device reported at each recorded tick, all files of the recording together.
/// Out     why  the recording is not whole, for people; empty: it is. Where it is damaged the last sample's reason says so
/// Fails   std::invalid_argument: no recording of a client, or one of more than 2 million ticks
std::shared_ptr<const std::vector<devices::DeviceSample>> read_recorded_hand(const std::filesystem::path& file,
                                                                             std::string& why);

}  // namespace tandem::client
