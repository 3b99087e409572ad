// What is in a recording, at a glance.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/json.hpp"

namespace tandem::lab {

/// `kind` is "room" or "client". Common: program, files, is_whole, is_damaged, why, begun_utc, duration_s, messages by topic. Of a room: scene,
/// users with their times, steps, commands, inputs, faults; of a client: user, device, stage, ticks, faults. `gaps`: what is
/// missing between the first step or tick and the last.
/// Fails   as read_recording()
boost::json::object recording_facts(const std::filesystem::path& file);

/// The same for people, a line each.
std::string facts_text(const boost::json::object& facts);

}  // namespace tandem::lab
