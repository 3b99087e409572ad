// Health of a server as text: whether its loops run, and whether users can join.
#pragma once

#include <string>
#include <vector>

#include "server/net/live_server.hpp"

namespace tandem::server {

/// Time limit for one iteration of the io thread's loop or of a room's loop. A step normally takes about a millisecond,
/// so a loop that exceeds the limit hangs.
inline constexpr Duration kGoesRoundWithin = std::chrono::seconds(1);

/// Describes the loops that have not completed an iteration within kGoesRoundWithin. Returns an empty string if there
/// is none, or if LiveServer::run() has not begun. The loop of an empty room iterates as well, to check for users.
/// In      rooms  names of the rooms
std::string standstill(const ServerPulse& pulse, const std::vector<std::string>& rooms, LocalTime now);

/// Returns the reason why no user can join; empty: users can join.
std::string why_not_ready(const ServerPulse& pulse, const std::vector<std::string>& rooms, LocalTime now);

}  // namespace tandem::server
