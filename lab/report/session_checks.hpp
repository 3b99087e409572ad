// Checks of a session in which two hands hold one body. The demo's exit code depends on them.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "lab/report/check.hpp"
#include "lab/report/session_data.hpp"

namespace tandem::lab {

/// Name of the phase in which the hands rest. The checks apply to this phase.
inline constexpr std::string_view kHoldPhase = "hold";

/// Returns the checks of all users of all sessions: ordered by session, then by user.
///
/// Fails   std::invalid_argument if a user has no phase "hold"
std::vector<Check> check_sessions(std::span<const Session> sessions);

}  // namespace tandem::lab
