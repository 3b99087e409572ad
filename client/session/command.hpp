// Commands of the user or of the program to a client, one type per command. A live client receives all commands by
// ClientIo::send(). Each layer performs the commands of its own type and passes all other commands on:
//
//   ClientIo::send(Command) ──▶ Client::send(ClientCommand) ──▶ ClientSession::send(SessionCommand) ──▶ server
//
// A command returns no result. Its effect appears in the next snapshot, or an event reports it (event.hpp).
// * A command that only sends a request to the server has a function write(), which fills in the request.
// * All other commands have a function of their own in the session (session_commands.cpp).
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "client/haptics/hand_workspace.hpp"
#include "client/haptics/stages/stage.hpp"
#include "common/base/ids.hpp"
#include "common/net/link.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

namespace command {

/// Makes the user's tool grab a body. If the id is invalid, the tool grabs the nearest graspable body within reach.
struct Grab {
  BodyId body;
  void write(wire::ClientControl& request) const { request.mutable_grab()->set_body(body.value); }
};
/// Makes the user's tool release the held body.
struct Release {
  static void write(wire::ClientControl& request) { request.mutable_release(); }
};
/// Sets a coefficient of the room's coupling (names and units: proto/coupling_fields.hpp). Operators only.
struct SetParameter {
  std::string name;
  double value = 0;
};
/// Sets the room's coupling law until this user leaves. Operators only.
struct SetLaw {
  std::string law;
};
/// Ends the session of a user, who then needs a new invitation to join again. Operators only.
struct Kick {
  UserId user;
  void write(wire::ClientControl& request) const { request.mutable_kick()->set_user(user.value); }
};
/// Resets all movable objects to their start poses. Operators only.
struct ResetRoom {
  static void write(wire::ClientControl& request) { request.mutable_reset_room(); }
};
/// Stores, restores, deletes or renames a pose of the room's two molecules, or starts or cancels an energy
/// minimisation.
struct RequestPose {
  wire::AskPose request;
  std::uint32_t tag = 0;  ///< tag of the event PoseAnswered that reports the result; 0: no event is emitted
};
/// Points at a position in the scene. The other users then see the position.
struct Point {
  wire::Point place;
  void write(wire::ClientControl& request) const { *request.mutable_point() = place; }
};
/// Changes to a different room of the same server. If that room refuses the user, the session returns to the present
/// room.
struct ChangeRoom {
  std::string room;
};
/// Changes the scale and rotation of the hand's workspace mapping, for the present and later scenes. No force is
/// displayed during the change: the force fades out while the tool stays in place, and is then ramped up again.
struct SetWorkspace {
  WorkspaceSettings workspace;
};
/// Switches nudges (force pulses) of the hand on or off. Without nudges, positions that other users point at are only
/// shown.
struct SetNudges {
  bool has_nudges = true;
};
/// Selects a stage and a predictor, and switches the passivity controller (Client::set_stage()).
struct SetStage {
  StageSettings stage;
};
/// Changes the simulated links in both directions. Ignored by a client without simulated links.
struct SetLinks {
  net::LinkParameters both;
};

}  // namespace command

using SessionCommand = std::variant<command::Grab, command::Release, command::SetParameter, command::SetLaw,
                                    command::Kick, command::ResetRoom, command::RequestPose, command::Point,
                                    command::ChangeRoom, command::SetWorkspace, command::SetNudges>;
using ClientCommand = std::variant<SessionCommand, command::SetStage>;
using Command = std::variant<ClientCommand, command::SetLinks>;

/// Returns a request about the poses of the room's molecules.
/// In      number  number of a stored pose, for GO_TO, DELETE and RENAME
///         name    for KEEP and RENAME
///         tag     tag of the event that reports the result; 0: no event is emitted
command::RequestPose pose_command(wire::AskPose::Kind kind, std::uint32_t number = 0, const std::string& name = {},
                                  std::uint32_t tag = 0);

}  // namespace tandem::client
