// Commands of the user or the program to a client, one type each. All of them enter by one door, ClientIo::send() for a
// live client. Each layer performs its own commands and passes the others on:
//
//   ClientIo::send(Command) ──▶ Client::send(ClientCommand) ──▶ ClientSession::send(SessionCommand) ──▶ server
//
// A command has no direct answer. Its effect is in the next snapshot, or an event reports it (event.hpp).
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

/// Grabs a body with the user's tool. An invalid id: the nearest graspable one within reach.
struct Grab {
  BodyId body;
};
/// Releases the held body.
struct Release {};
/// Sets a coefficient of the room's coupling (names and units: proto/coupling_fields.hpp); operator only.
struct SetParameter {
  std::string name;
  double value = 0;
};
/// Sets the room's coupling law until this user leaves; operator only.
struct SetLaw {
  std::string law;
};
/// Ends another user's session; that user needs a new invitation to join again. Operator only.
struct Kick {
  UserId user;
};
/// Resets all movable objects to their start; operator only.
struct ResetRoom {};
/// Keeps, restores, deletes or renames a pose of the room's two molecules, or starts or cancels a minimisation.
struct RequestPose {
  wire::AskPose request;
  std::uint32_t tag = 0;  ///< number of the event PoseAnswered; 0: no such event
};
/// Points at a place, which the other users are shown.
struct Point {
  wire::Point place;
};
/// Leaves this room for another of the same server; returns to this room if the other one refuses.
struct ChangeRoom {
  std::string room;
};
/// Changes the hand's mapping, now and for later scenes. The force fades out, the tool stays, and the force returns by
/// the ramp.
struct SetWorkspace {
  WorkspaceSettings workspace;
};
/// Selects whether places that other users point at nudge the hand or are only shown.
struct SetNudges {
  bool has_nudges = true;
};
/// Selects another stage, predictor or passivity controller (Client::set_stage()).
struct SetStage {
  StageSettings stage;
};
/// Changes the simulated links in both directions at once; ignored by a client without simulated links.
struct SetLinks {
  net::LinkParameters both;
};

}  // namespace command

using SessionCommand = std::variant<command::Grab, command::Release, command::SetParameter, command::SetLaw,
                                    command::Kick, command::ResetRoom, command::RequestPose, command::Point,
                                    command::ChangeRoom, command::SetWorkspace, command::SetNudges>;
using ClientCommand = std::variant<SessionCommand, command::SetStage>;
using Command = std::variant<ClientCommand, command::SetLinks>;

/// A request about poses.
/// In      number  number of a kept pose, for GO_TO, DELETE and RENAME
///         name    for KEEP and RENAME
///         tag     as in command::RequestPose
command::RequestPose pose_command(wire::AskPose::Kind kind, std::uint32_t number = 0, const std::string& name = {},
                                  std::uint32_t tag = 0);

}  // namespace tandem::client
