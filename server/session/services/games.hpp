// Parameters of a game, which users set by SetParameter.
#pragma once

#include <string>
#include <string_view>

#include "server/session/services/service.hpp"

namespace tandem::server {

/// Number of the level to start, from 1.
inline constexpr std::string_view kLevelParameter = "game.level";
/// 1: gravity of the level; 0: none.
inline constexpr std::string_view kGravityParameter = "game.gravity";

bool is_game_parameter(const std::string& name);
/// Passes the request to the room. Returns the reason of a refusal; empty if the room will apply it.
std::string post_game_parameter(SessionUser& user, const wire::SetParameter& wanted);

}  // namespace tandem::server
