// Messages of the server on the control channel, as pure functions of the facts. session_control.cpp and
// session_hub.cpp decide when to send them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/control_framing.hpp"
#include "proto/coupling_fields.hpp"
#include "server/room/room_seats.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::server {

inline constexpr const char* kRoomBusy = "the room is busy; try again";

/// Makes client text safe for a log or an error text.
std::string quoted(const std::string& text);

wire::ServerControl error_answer(std::uint32_t request, wire::ErrorCode code, const std::string& text);
wire::ServerControl goodbye(std::uint32_t request, wire::DisconnectReason reason, const std::string& text);

/// Fills all fields except the connection's id and epoch and the rooms.
wire::ServerControl welcome_answer(std::uint32_t request, const HubSettings& settings);

/// Everything that a new user needs: the scene with the coupling in force for their tool, the tool, the assets.
wire::ServerControl joined_answer(std::uint32_t request, const RoomSeats& seats, const Seat& seat);
wire::ServerControl room_start(const RoomStart& start);
wire::ServerControl user_joined(const Seat& seat, const std::string& name);
wire::ServerControl user_left(const Seat& seat, wire::DisconnectReason reason);

/// Answer to Grab and Release, from the room's event.
wire::ServerControl grab_answer(const RoomEvent& event);

/// Sent to all users: a body left the scene or became non-finite, and was put back.
wire::ServerControl body_returned(BodyId body);
wire::ServerControl kept_pose(const wire::KeptPose& pose);
wire::ServerControl room_reset(std::uint32_t request, UserId by);
wire::ServerControl soft_shape(std::size_t soft_body, const std::vector<Vec3>& offsets_W);
/// Value in force of a coefficient for one user.
wire::ServerControl parameter_set(const proto::CouplingField& field, const haptics::CouplingParameters& in_force);
wire::ServerControl law_set(std::string_view law);

/// A chunk of a scene's asset, or an error with the reason.
wire::ServerControl asset_answer(std::uint32_t request, const wire::GetAsset& wanted, const LoadedScene& scene);

/// An upper bound of joined_answer()'s size for any user.
std::size_t joined_answer_bound(const LoadedScene& scene);

}  // namespace tandem::server
