// Messages of the hub on the control channel, as pure functions of the facts. Services make their own (services/).
#pragma once

#include <cstdint>
#include <string>

#include "server/room/room_seats.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::server {

wire::ServerControl error_answer(std::uint32_t request, wire::ErrorCode code, const std::string& text);
wire::ServerControl goodbye(std::uint32_t request, wire::DisconnectReason reason, const std::string& text);

/// Fills all fields except the connection's id and epoch and the rooms.
wire::ServerControl welcome_answer(std::uint32_t request, const HubSettings& settings);

/// Everything that a new user needs: the scene with the coupling in force for their tool, the tool, the assets.
wire::ServerControl joined_answer(std::uint32_t request, const RoomSeats& seats, const Seat& seat);
wire::ServerControl room_start(const RoomStart& start);
wire::ServerControl user_joined(const Seat& seat, const std::string& name);
wire::ServerControl user_left(const Seat& seat, wire::DisconnectReason reason);

/// An upper bound of joined_answer()'s size for any user.
std::size_t joined_answer_bound(const LoadedScene& scene);

}  // namespace tandem::server
