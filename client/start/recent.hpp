// Data that the window keeps from one run to the next: small JSON files in the user's state folder.
#pragma once

#include <boost/json.hpp>
#include <cstddef>
#include <filesystem>
#include <vector>

#include "client/start/start_choice.hpp"

namespace tandem::client {

/// Returns $XDG_STATE_HOME/tandem, otherwise ~/.local/state/tandem. Empty if neither folder is known.
std::filesystem::path state_folder();
/// Reads a JSON file of at most 16 KiB. Returns null if it is missing, larger or invalid.
boost::json::value read_state(const std::filesystem::path& file);

/// Returns the path of the file with the choices of earlier runs; empty if the state folder is unknown.
std::filesystem::path recent_file();
inline constexpr std::size_t kMaxRecent = 6;
/// Reads the last choices, the newest first. Invalid entries are skipped. Invitations are never stored.
std::vector<StartChoice> recent_choices(const std::filesystem::path& file);
/// Stores a choice as the newest, with only the fields that its kind uses. Only the user can read the file. Two texts
/// are not stored: an invitation, because it is a secret, and a text that is not UTF-8. Errors are ignored.
void remember_choice(const std::filesystem::path& file, const StartChoice& choice);

}  // namespace tandem::client
