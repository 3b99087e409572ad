// Files of the poses that users keep: a list that a later server reads again, a table for people, structures for viewers.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/room/room.hpp"
#include "tandem/control.pb.h"

namespace tandem::server {

inline constexpr std::size_t kMaxKeptPoses = 200;

/// ROOM-SCENE, fit for a folder's name, and no other room's or scene's.
std::string kept_pose_folder(const Room& room);

/// Of the second molecule in the frame of the first [Å]; none where that cannot be a pose.
std::optional<Pose> in_first(const wire::KeptPose& pose);

/// As poses.json has them: numbered from 1, at most kMaxKeptPoses; none without a file. Fields that it does not know, of a
/// newer server, are left out.
/// Out     nothing where the file is not such a list: who writes another one would lose what is in it
std::optional<std::vector<wire::KeptPose>> read_kept_poses(const std::filesystem::path& folder);

/// poses.csv, a line a pose, and poses.json: each whole or as it was.
/// Fails   std::runtime_error: what stands in the way, such as a name that is no UTF-8
void write_kept_poses(const std::filesystem::path& folder, std::span<const wire::KeptPose> poses);

/// NUMBER.cif, and where it can hold them NUMBER.pdb: both molecules as their files have the first one.
/// Fails   see save_complex()
void save_kept_pose(const std::filesystem::path& folder, const wire::KeptPose& pose, const Room& room, BodyId first,
                    BodyId second);

}  // namespace tandem::server
