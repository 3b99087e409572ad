// Checks of a session with two hands on one body. They decide the exit code of the demo.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "lab/report/check.hpp"
#include "lab/report/session_data.hpp"

namespace tandem::lab {

/// Phase in which the hands rest and the checks apply.
inline constexpr std::string_view kHoldPhase = "hold";

/// Returns all checks of every user of every session, in that order.
///
/// Fails   std::invalid_argument if a user has no phase "hold"
std::vector<Check> check_sessions(std::span<const Session> sessions);

}  // namespace tandem::lab
