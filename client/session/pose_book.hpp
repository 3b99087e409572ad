// Poses of the room's two molecules, as a client knows them from the server, and this user's open requests about them.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/session/event.hpp"

namespace tandem::client {

/// Messages of the server are checked; invalid ones change nothing.
///
/// Thread  io
class PoseBook {
 public:
  static constexpr std::size_t kMaxPoses = 256;

  /// Forgets the poses and the progress of the last room; open requests stay.
  void clear();
  /// Accepts poses in ascending order from number 0. A known number is a new name.
  /// Out     news for the user; empty: none
  std::string receive(const wire::KeptPose& pose);
  /// The pose of the files, number 0, cannot be deleted.
  /// Out     news for the user; empty: none
  std::string receive(const wire::PoseDeleted& deleted);
  void receive(const wire::PoseProgress& progress, std::uint32_t own_user);

  /// Registers a request by its number on the wire. Its answer carries the tag.
  void await(std::uint32_t request, std::uint32_t tag);
  /// Returns the event of the request that `message` answers; nothing if it answers none.
  std::optional<event::PoseAnswered> answer(const wire::ServerControl& message);
  /// Ends all open requests with an error, because their connection has ended.
  std::vector<event::PoseAnswered> refuse_all(const std::string& why);

  /// Poses ascending by number; null: none received.
  const std::shared_ptr<const std::vector<wire::KeptPose>>& kept() const { return kept_; }
  /// Progress of the running minimisation in the room; none: none is running.
  const std::optional<wire::PoseProgress>& progress() const { return progress_; }

 private:
  std::shared_ptr<const std::vector<wire::KeptPose>> kept_;
  std::optional<wire::PoseProgress> progress_;
  wire::PoseProgress own_progress_;              ///< last progress of this user's minimisations
  std::map<std::uint32_t, std::uint32_t> tags_;  ///< tags of open requests by number
};

}  // namespace tandem::client
