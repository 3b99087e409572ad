// Summary of a recording.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/json.hpp"

namespace tandem::lab {

/// Returns the summary of a recording as JSON. Its field `kind` is "room" or "client". Its field `gaps` is the number
/// of steps (room) or ticks (client) that are missing between the first and the last recorded one.
///
/// Out     both    program, files, is_whole, is_damaged, why, begun_utc, duration_s, and the number of messages by
///         topic
///         room    scene, users with their times, steps, commands, inputs and faults
///         client  user, device, stage, ticks and faults
/// Fails   see read_recording()
boost::json::object recording_facts(const std::filesystem::path& file);

/// Returns the same summary as text, with one line for each fact.
std::string facts_text(const boost::json::object& facts);

}  // namespace tandem::lab
