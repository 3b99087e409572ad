// Stores the poses of the room's two molecules that the server has sent, and this user's unanswered requests about
// poses.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/session/event.hpp"

namespace tandem::client {

/// Stored poses, and unanswered requests about poses. Received messages are validated; an invalid one changes nothing.
///
/// Thread  io
class PoseBook {
 public:
  static constexpr std::size_t kMaxPoses = 256;

  /// Discards the poses and the progress of the previous room. Unanswered requests remain.
  void clear();
  /// Adds a stored pose; the numbers of new poses must ascend from 0. A message with a known number renames that pose.
  /// Out     text for the user; empty if there is nothing to report
  std::string receive(const wire::KeptPose& pose);
  /// Removes a deleted pose. Pose 0, which comes from the files, cannot be deleted.
  /// Out     text for the user; empty if there is nothing to report
  std::string receive(const wire::PoseDeleted& deleted);
  void receive(const wire::PoseProgress& progress, std::uint32_t own_user);

  /// Stores an unanswered request: its number `request` in the protocol, and the tag `tag` for the event that will
  /// report the result.
  void await(std::uint32_t request, std::uint32_t tag);
  /// Returns the event for the pose request that `message` answers; nothing if it answers no pose request.
  std::optional<event::PoseAnswered> answer(const wire::ServerControl& message);
  /// Returns an error event for each unanswered request and discards the requests. Called when the connection has
  /// ended.
  std::vector<event::PoseAnswered> refuse_all(const std::string& why);

  /// Returns the stored poses in ascending order of their numbers; null if none were received.
  const std::shared_ptr<const std::vector<wire::KeptPose>>& kept() const { return kept_; }
  /// Returns the progress of the running energy minimisation in the room; empty if none is running.
  const std::optional<wire::PoseProgress>& progress() const { return progress_; }

 private:
  std::shared_ptr<const std::vector<wire::KeptPose>> kept_;
  std::optional<wire::PoseProgress> progress_;
  wire::PoseProgress own_progress_;              ///< last progress of the minimisations that this user started
  std::map<std::uint32_t, std::uint32_t> tags_;  ///< unanswered requests: request number → tag
};

}  // namespace tandem::client
