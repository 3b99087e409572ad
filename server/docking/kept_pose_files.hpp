// Files of kept poses: a list that a later server reads again, a table for spreadsheets, structures for viewers.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/room/room.hpp"
#include "tandem/control.pb.h"

namespace tandem::server {

inline constexpr std::size_t kMaxKeptPoses = 200;

/// Kept poses of a room, by ascending numbers from 1.
struct KeptPoseList {
  std::vector<wire::KeptPose> poses;
  std::uint32_t next_number = 1;  ///< larger than all numbers ever used
};

/// Folder name ROOM-SCENE; unique for each room and scene.
std::string kept_pose_folder(const Room& room);

/// Pose of the second molecule in the frame of the first [Å]; none if it is no valid pose.
std::optional<Pose> in_first(const wire::KeptPose& pose);

/// Reads poses.json, at most kMaxKeptPoses; an empty list without a file. Ignores fields of a newer server.
/// Out     nothing if the file is not such a list: overwriting it would lose its contents
std::optional<KeptPoseList> read_kept_poses(const std::filesystem::path& folder);

/// Writes poses.csv, one line per pose, and poses.json, the authoritative list. Each file is replaced as a whole or
/// left unchanged.
/// Fails   std::runtime_error: the reason, such as a name that is not UTF-8
void write_kept_poses(const std::filesystem::path& folder, const KeptPoseList& list);

/// Writes NUMBER.cif and, if the format can hold them, NUMBER.pdb: both molecules in the frame of the first one's file.
/// In      room  name, for a remark
/// Fails   see save_complex()
void save_kept_pose(const std::filesystem::path& folder, const wire::KeptPose& pose, const std::string& room,
                    const LoadedScene& scene, BodyId first, BodyId second);

/// Removes NUMBER.cif and NUMBER.pdb for each used number that is not in the list. This includes files of a server that
/// was killed before it removed them. Other files stay.
void remove_deleted_poses(const std::filesystem::path& folder, const KeptPoseList& list);

}  // namespace tandem::server
