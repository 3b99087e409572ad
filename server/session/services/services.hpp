// Factory functions for the services of a hub. The source file of a service has the name of the service.
#pragma once

#include <memory>

#include "server/docking/pose_keeper.hpp"
#include "server/session/services/service.hpp"

namespace tandem::server {

/// Handles Grab and Release. Reports their results, and bodies that have returned to their start.
std::unique_ptr<SessionService> make_grasping(ServiceHost& host);
/// Handles SetParameter: sets the law and the coefficients of a room's coupling, and reports their changes. Parameters
/// of games go to the game (games.hpp).
std::unique_ptr<SessionService> make_coupling(ServiceHost& host);
/// Handles Kick and ResetRoom, which only the operator of a room may request.
/// In      poses  null if no poses are saved
std::unique_ptr<SessionService> make_moderation(ServiceHost& host, PoseKeeper* poses);
/// Handles AskPose: saved poses of a room's two molecules, undo and redo, and minimisation.
/// In      poses  if null, every request is refused
std::unique_ptr<SessionService> make_poses(ServiceHost& host, PoseKeeper* poses);
/// Handles Point, which shows a position to all users of a room.
std::unique_ptr<SessionService> make_pointing(ServiceHost& host);
/// Handles Signal, which sets a signal of the room's game.
std::unique_ptr<SessionService> make_signals(ServiceHost& host);
/// Handles GetAsset, which requests one chunk of an asset of the room's scene.
std::unique_ptr<SessionService> make_assets(ServiceHost& host);
/// Sends the state and the events of games, and passes the coupling of a level on to RoomSeats.
/// In      on_call  called with the room and the reason when a game calls a person; may be empty
std::unique_ptr<SessionService> make_games(ServiceHost& host,
                                           std::function<void(const std::string&, const std::string&)> on_call);
/// Sends the shapes of soft bodies to the users who requested them when they joined.
std::unique_ptr<SessionService> make_soft_shapes(ServiceHost& host);

}  // namespace tandem::server
