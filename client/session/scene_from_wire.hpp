// Validates the server's description of the scene before it reaches the haptic path.
#pragma once

#include <optional>
#include <string>

#include "client/exchange/mailboxes.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Returns true for roles with a tool; an observer has no tool.
inline bool has_tool(wire::Role role) {
  return role == wire::ROLE_MANIPULATOR || role == wire::ROLE_OPERATOR;
}
/// Returns the name of the role, as in the option --role.
std::string role_name(wire::Role role);

/// Reads the message about the common start of a room's hands. A valid message contains either the users that are still
/// awaited or a start time. Returns nothing if it contains both or neither, or too many users.
std::optional<HandStart> read_start(const wire::RoomStart& start);

/// Fills in the workspace and coupling of `out` from the join message. For an observer, `may_drive` and `may_display`
/// are false.
///
/// Out     empty text if the message is usable. Otherwise the first unusable field, its value and the remedy; the
///         content of `out` is then unspecified
std::string fill_haptic_scene(const wire::Joined& joined, HapticScene& out);

}  // namespace tandem::client
