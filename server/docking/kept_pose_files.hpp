// Files with the saved poses of a room: a list for the next server, a table for spreadsheets, and molecular structures
// for viewers.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/room/room.hpp"
#include "tandem/control.pb.h"

namespace tandem::server {

inline constexpr std::size_t kMaxKeptPoses = 200;

/// Saved poses of a room, sorted by number; the first number is 1.
struct KeptPoseList {
  std::vector<wire::KeptPose> poses;
  std::uint32_t next_number = 1;  ///< number for the next saved pose, larger than all numbers used before
};

/// Name of the room's folder, ROOM-SCENE. It is unique for each combination of room name and scene.
std::string kept_pose_folder(const Room& room);

/// Pose of the second molecule in the frame of the first [Å]; none if the stored numbers do not form a valid pose.
std::optional<Pose> in_first(const wire::KeptPose& pose);

/// Reads poses.json. Fields of a newer version of the format are ignored.
/// Out     the list; empty if the file does not exist. None: the file is not a valid list of at most kMaxKeptPoses
///         poses. The caller must then not overwrite the file, because its contents would be lost.
std::optional<KeptPoseList> read_kept_poses(const std::filesystem::path& folder);

/// Writes poses.json, the list that read_kept_poses() reads, and poses.csv, a table with one line per pose. Each file
/// is either replaced completely or left unchanged.
/// Fails   std::runtime_error with the reason, for example a name that is not UTF-8
void write_kept_poses(const std::filesystem::path& folder, const KeptPoseList& list);

/// Writes both molecules to NUMBER.cif and, if the PDB format can represent them, to NUMBER.pdb. The coordinates are in
/// the frame of the first molecule's structure file.
/// In      room  name of the room, which is written as a remark
/// Fails   see save_complex()
void save_kept_pose(const std::filesystem::path& folder, const wire::KeptPose& pose, const std::string& room,
                    const LoadedScene& scene, BodyId first, BodyId second);

/// Removes NUMBER.cif and NUMBER.pdb for each NUMBER below next_number that is not in the list. Such files remain if a
/// server was killed while it deleted a pose. Other files are not changed.
void remove_deleted_poses(const std::filesystem::path& folder, const KeptPoseList& list);

}  // namespace tandem::server
