// What a session of two hands on one body must show to be called good. The demo's exit code is the answer.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "lab/report/check.hpp"
#include "lab/report/session_data.hpp"

namespace tandem::lab {

/// In which hands rest, and the checks look.
inline constexpr std::string_view kHoldPhase = "hold";

/// All checks of every user of every session, in that order.
///
/// Fails   std::invalid_argument when a user has no phase "hold": there is nothing to check then
std::vector<Check> check_sessions(std::span<const Session> sessions);

}  // namespace tandem::lab
