// The services of a hub, each in the source of its name.
#pragma once

#include <memory>

#include "server/docking/pose_keeper.hpp"
#include "server/session/services/service.hpp"

namespace tandem::server {

/// Grab and Release, their results, and bodies that were put back.
std::unique_ptr<SessionService> make_grasping(ServiceHost& host);
/// SetParameter: coefficients and law of a room's coupling, and news of their changes.
std::unique_ptr<SessionService> make_coupling(ServiceHost& host);
/// Kick and ResetRoom, by a room's operator.
/// In      poses  null: no poses are kept
std::unique_ptr<SessionService> make_moderation(ServiceHost& host, PoseKeeper* poses);
/// AskPose: kept poses of a room's two molecules, undo, and minimisation.
/// In      poses  null: every request is refused
std::unique_ptr<SessionService> make_poses(ServiceHost& host, PoseKeeper* poses);
/// Point: shows a place to the users of a room.
std::unique_ptr<SessionService> make_pointing(ServiceHost& host);
/// GetAsset: assets of a room's scene, chunk by chunk.
std::unique_ptr<SessionService> make_assets(ServiceHost& host);
/// Shapes of soft bodies for users who display them.
std::unique_ptr<SessionService> make_soft_shapes(ServiceHost& host);

}  // namespace tandem::server
