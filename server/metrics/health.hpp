// Health of a server: whether it runs and whether users can join it, as text.
#pragma once

#include <string>
#include <vector>

#include "server/net/live_server.hpp"

namespace tandem::server {

/// Time limit for one iteration of io or a room. A step has a millisecond; a room that is too large still steps.
inline constexpr Duration kGoesRoundWithin = std::chrono::seconds(1);

/// Describes the loops that stand still; empty: all run, or run() has not begun. The loop of an empty room also
/// iterates, to check for users.
/// In      rooms  names of the rooms
std::string standstill(const ServerPulse& pulse, const std::vector<std::string>& rooms, LocalTime now);

/// Reason for which nobody can join; empty: users can join.
std::string why_not_ready(const ServerPulse& pulse, const std::vector<std::string>& rooms, LocalTime now);

}  // namespace tandem::server
