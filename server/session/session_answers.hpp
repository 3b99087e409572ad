// Functions that build the control messages of the hub from their arguments, without side effects. Services build their
// own messages (services/).
#pragma once

#include <cstdint>
#include <string>

#include "server/room/room_seats.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::server {

wire::ServerControl error_answer(std::uint32_t request, wire::ErrorCode code, const std::string& text);
wire::ServerControl goodbye(std::uint32_t request, wire::DisconnectReason reason, const std::string& text);

/// Returns a Welcome with all fields except the id and epoch of the connection and the list of rooms.
wire::ServerControl welcome_answer(std::uint32_t request, const HubSettings& settings);

/// Returns the data for a new user: the scene, the user's tool with its effective coupling, and the list of assets.
wire::ServerControl joined_answer(std::uint32_t request, const RoomSeats& seats, const Seat& seat);
/// Returns the answer to a source of signals: the names of the room's signals, without the scene.
wire::ServerControl joined_source_answer(std::uint32_t request, const LoadedScene& scene, const Seat& source);
wire::ServerControl room_start(const RoomStart& start);
wire::ServerControl user_joined(const Seat& seat, const std::string& name);
wire::ServerControl user_left(const Seat& seat, wire::DisconnectReason reason);

/// Returns an upper bound of the size of joined_answer() for any user [bytes].
std::size_t joined_answer_bound(const LoadedScene& scene);

}  // namespace tandem::server
