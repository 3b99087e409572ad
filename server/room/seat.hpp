// A seat of a room and its user.
#pragma once

#include <array>
#include <cstdint>

#include "common/base/ids.hpp"
#include "common/haptics/coupling/rendered_coupling.hpp"

namespace tandem::server {

/// Role of a user in a room.
/// * kManipulator: has a tool.
/// * kObserver: receives states but has no tool.
/// * kOperator: a manipulator who may also set the room's parameters; at most one per room.
/// * kSignal: a program that sends signals to the game; it has no seat.
enum class UserRole : std::uint8_t { kManipulator, kObserver, kOperator, kSignal };
constexpr bool has_tool(UserRole role) {
  return role == UserRole::kManipulator || role == UserRole::kOperator;
}

/// A seat of a room and its user. The io thread and the room's loop each have a copy.
struct Seat {
  std::uint8_t index = 0;  ///< index in the room's fixed arrays, < proto::kMaxUsers
  UserId user = {};        ///< user of the seat; invalid: the seat is free
  UserRole role = UserRole::kObserver;
  std::uint8_t tool = 0;     ///< index of the user's tool; valid if has_tool(role)
  bool leaves_gaps = false;  ///< whether the user suppresses inputs that can be extrapolated (deadband)
  haptics::CouplingParameters coupling_bounds =
      haptics::kNoCouplingBounds;    ///< largest coupling that the user's device can render, in the scale of the world
  std::array<char, 80> user_name{};  ///< name of the user for recordings, terminated by zero

  bool is_manipulator() const { return user.is_valid() && has_tool(role); }
};

}  // namespace tandem::server
