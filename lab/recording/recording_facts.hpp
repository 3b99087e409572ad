// Summary of a recording.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/json.hpp"

namespace tandem::lab {

/// `kind` is "room" or "client". Common fields: program, files, is_whole, is_damaged, why, begun_utc, duration_s,
/// messages by topic. A room adds scene, users with their times, steps, commands, inputs, faults; a client adds user,
/// device, stage, ticks, faults. `gaps`: steps or ticks missing between the first and the last.
/// Fails   see read_recording()
boost::json::object recording_facts(const std::filesystem::path& file);

/// The same summary as text, one line for each fact.
std::string facts_text(const boost::json::object& facts);

}  // namespace tandem::lab
