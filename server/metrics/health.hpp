// Whether a server goes on, and whether somebody can join it, in words.
#pragma once

#include <string>
#include <vector>

#include "server/net/live_server.hpp"

namespace tandem::server {

/// So long may io, or a room, take to go round. A step has a millisecond; a room that is too large still steps.
inline constexpr Duration kGoesRoundWithin = std::chrono::seconds(1);

/// What stands still; empty: all goes on, or run() has not begun. A room that nobody is in goes round too: it looks whether
/// somebody has come.
/// In      rooms  their names
std::string standstill(const ServerPulse& pulse, const std::vector<std::string>& rooms, LocalTime now);

/// Why nobody can join; empty: they can.
std::string why_not_ready(const ServerPulse& pulse, const std::vector<std::string>& rooms, LocalTime now);

}  // namespace tandem::server
