#include "server/docking/kept_poses.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

namespace tandem::server {
namespace {

bool has_same_numbers(const KeptPoseList& one, const KeptPoseList& other) {
  return one.next_number == other.next_number &&
         std::ranges::equal(one.poses, other.poses, {}, &wire::KeptPose::number, &wire::KeptPose::number);
}

}  // namespace

KeptPoses::KeptPoses(std::string room, std::filesystem::path folder, wire::KeptPose of_files, const MoleculePair& pair)
    : room_(std::move(room)), folder_(std::move(folder)), of_files_(std::move(of_files)), pair_(&pair) {
  if (const auto listed = read_kept_poses(folder_)) list_ = *listed;
}

KeptPoses::~KeptPoses() {
  if (lock_ >= 0) ::close(lock_);
}

const wire::KeptPose* KeptPoses::find(std::uint32_t number) const {
  if (number == 0) return &of_files_;
  const auto found = std::ranges::find(list_.poses, number, &wire::KeptPose::number);
  return found == list_.poses.end() ? nullptr : &*found;
}

std::string KeptPoses::problem_of_adding(const std::string& user_name) const {
  if (list_.poses.size() >= kMaxKeptPoses)
    return "this room has kept " + std::to_string(kMaxKeptPoses) +
           " poses, and keeps no more; delete some that are not needed";
  const auto own = std::ranges::count(list_.poses, user_name, &wire::KeptPose::user_name);
  if (static_cast<std::size_t>(own) < kMaxKeptPosesOfUser) return {};
  return "you have kept " + std::to_string(own) + " poses in this room, and a user keeps at most " +
         std::to_string(kMaxKeptPosesOfUser) + "; delete one of yours";
}

std::string KeptPoses::add(const wire::KeptPose& pose) {
  KeptPoseList longer = list_;
  longer.poses.push_back(pose);
  ++longer.next_number;
  return replace(std::move(longer), &pose);
}

std::string KeptPoses::remove(std::uint32_t number) {
  KeptPoseList left = list_;
  std::erase_if(left.poses, [number](const wire::KeptPose& pose) { return pose.number() == number; });
  std::string problem = replace(std::move(left), nullptr);
  if (problem.empty() && !folder_.empty()) remove_deleted_poses(folder_, list_);
  return problem;
}

std::string KeptPoses::rename(std::uint32_t number, const std::string& name) {
  KeptPoseList renamed = list_;
  std::ranges::find(renamed.poses, number, &wire::KeptPose::number)->set_name(name);
  return replace(std::move(renamed), nullptr);
}

std::string KeptPoses::replace(KeptPoseList list, const wire::KeptPose* added) {
  std::string problem = write(list, added);
  if (problem.empty()) list_ = std::move(list);
  return problem;
}

/// Writes the list, and the structure files of `added` unless it is null. Returns the reason of a failure; empty if it
/// succeeded.
std::string KeptPoses::write(const KeptPoseList& list, const wire::KeptPose* added) {
  if (folder_.empty()) return {};
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (lock_ < 0) lock_ = ::open((folder_ / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock_ < 0) return "the server cannot write into its folder (--keep)";
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) return "another server keeps poses in that folder (--keep)";
  const auto listed = read_kept_poses(folder_);
  if (!listed) return (folder_ / "poses.json").string() + " is no list of poses; move it elsewhere";
  if (!is_known_ && !has_same_numbers(*listed, list_))
    return "another server has kept poses in that folder (--keep) since this one read them; start this one again";
  is_known_ = true;
  try {
    if (added != nullptr) save_kept_pose(folder_, *added, room_, pair_->scene(), pair_->first(), pair_->second());
    write_kept_poses(folder_, list);
  } catch (const std::exception& problem) {
    return problem.what();
  }
  return {};
}

}  // namespace tandem::server
