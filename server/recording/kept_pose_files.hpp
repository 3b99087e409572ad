// Files of the poses that users keep: a list that a later server reads again, a table for people, structures for viewers.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/room/room.hpp"
#include "tandem/control.pb.h"

namespace tandem::server {

inline constexpr std::size_t kMaxKeptPoses = 200;

/// The poses that are kept of a room, from number 1 on, by ascending numbers.
struct KeptPoseList {
  std::vector<wire::KeptPose> poses;
  std::uint32_t next_number = 1;  ///< larger than all that were ever used
};

/// ROOM-SCENE, fit for a folder's name, and no other room's or scene's.
std::string kept_pose_folder(const Room& room);

/// Of the second molecule in the frame of the first [Å]; none where that cannot be a pose.
std::optional<Pose> in_first(const wire::KeptPose& pose);

/// Of poses.json, at most kMaxKeptPoses; an empty list without a file. Fields of a newer server are left out.
/// Out     nothing where the file is not such a list: to write another one would lose its contents
std::optional<KeptPoseList> read_kept_poses(const std::filesystem::path& folder);

/// poses.csv, a line a pose, and poses.json, which is the truth: each whole or as it was.
/// Fails   std::runtime_error: the reason, such as a name that is no UTF-8
void write_kept_poses(const std::filesystem::path& folder, const KeptPoseList& list);

/// Writes NUMBER.cif, and where it can hold them NUMBER.pdb: both molecules as their files have the first one.
/// In      room  its name, for a remark
/// Fails   see save_complex()
void save_kept_pose(const std::filesystem::path& folder, const wire::KeptPose& pose, const std::string& room,
                    const LoadedScene& scene, BodyId first, BodyId second);

/// Removes NUMBER.cif and NUMBER.pdb of each number that was used and is not in the list: of a pose that was deleted, also by a
/// server that was killed before it removed them. Other files stay.
void remove_deleted_poses(const std::filesystem::path& folder, const KeptPoseList& list);

}  // namespace tandem::server
