// What the server says about the scene, checked before it can reach the haptic path.
#pragma once

#include <optional>
#include <string>

#include "client/haptics/mailboxes.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// An observer has none.
inline bool has_tool(wire::Role role) {
  return role == wire::ROLE_MANIPULATOR || role == wire::ROLE_OPERATOR;
}
/// As --role has it.
std::string role_name(wire::Role role);

/// When the hands of a room begin. Nothing: users are awaited and the time is set, or neither, or more than a room has.
std::optional<HandStart> read_start(const wire::RoomStart& start);

/// Fills workspace and coupling of `out` from the user's place in the joined scene; `may_drive` and
/// `may_display` tell a manipulator from an observer.
///
/// Out     empty, or the first field that cannot be used, with its value and what would do (`out` is then unspecified)
std::string fill_haptic_scene(const wire::Joined& joined, HapticScene& out);

}  // namespace tandem::client
