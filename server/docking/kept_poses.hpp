// List of a room's saved poses, and its files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "server/docking/kept_pose_files.hpp"
#include "server/docking/molecule_pair.hpp"

namespace tandem::server {

/// Maximum number of poses that one user may have saved in a room.
inline constexpr std::size_t kMaxKeptPosesOfUser = 50;

/// Saved poses of one room. A change is first written to the files, and takes effect only if that succeeds.
///
/// Model   Several servers may use the same folder. The first change of the list locks the folder until this object is
///         destroyed, so that no other server can change the files.
/// Thread  any, one at a time
class KeptPoses {
 public:
  /// Reads the list of the room's folder.
  ///
  /// In      room     name of the room, which is written into structure files
  ///         folder   folder of the room; if empty, no file is read or written
  ///         of_files  pose number 0: the relative pose that the molecules have in their structure files
  ///         pair     must outlive this object
  KeptPoses(std::string room, std::filesystem::path folder, wire::KeptPose of_files, const MoleculePair& pair);
  ~KeptPoses();
  KeptPoses(const KeptPoses&) = delete;
  KeptPoses& operator=(const KeptPoses&) = delete;

  /// Saved poses, sorted by number. Number 0 is not included.
  const std::vector<wire::KeptPose>& all() const { return list_.poses; }
  const wire::KeptPose& of_files() const { return of_files_; }
  /// Number of the next saved pose.
  std::uint32_t next_number() const { return list_.next_number; }
  /// Returns the pose with this number, including 0; null if there is none.
  const wire::KeptPose* find(std::uint32_t number) const;
  /// Returns the reason why the user or the room may not save another pose; empty if they may.
  std::string problem_of_adding(const std::string& user_name) const;

  // The following functions return the reason of a failure; an empty text means success.

  /// Adds a pose with the next number.
  std::string add(const wire::KeptPose& pose);
  /// Deletes a saved pose and its structure files.
  /// In      number  number of a saved pose, not 0
  std::string remove(std::uint32_t number);
  /// Changes the name of a pose in the list. Structure files are named by number, so they do not change.
  ///
  /// In      number  number of a saved pose
  std::string rename(std::uint32_t number, const std::string& name);

 private:
  std::string replace(KeptPoseList list, const wire::KeptPose* added);
  std::string write(const KeptPoseList& list, const wire::KeptPose* added);

  std::string room_;
  std::filesystem::path folder_;
  wire::KeptPose of_files_;
  const MoleculePair* pair_;
  KeptPoseList list_;
  int lock_ = -1;  ///< descriptor of the lock file; -1 if it is not open
  /// true: poses.json was found to list the poses of list_. The check is not repeated, because no other server can change
  /// the file while the lock is held.
  bool is_known_ = false;
};

}  // namespace tandem::server
