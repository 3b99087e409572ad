// Parameters of a game that users set with the message SetParameter.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/session/services/service.hpp"

namespace tandem::server {

/// Number of the level to start, from 1.
inline constexpr std::string_view kLevelParameter = "game.level";
/// Gravity: 1 as in the level, 0 none.
inline constexpr std::string_view kGravityParameter = "game.gravity";

bool is_game_parameter(const std::string& name);

struct GameRefusal {
  wire::ErrorCode code = wire::ERROR_NOT_ALLOWED;
  std::string text;
};
/// Returns the reason why the user may not set the parameter to this value; none if they may.
std::optional<GameRefusal> game_parameter_problem(const SessionUser& user, const wire::SetParameter& wanted);
/// Passes a request to the room that game_parameter_problem() has accepted. Returns false if the room's queue is full.
bool post_game_parameter(SessionUser& user, const wire::SetParameter& wanted);

}  // namespace tandem::server
