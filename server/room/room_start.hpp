// Common start of all hands of a room, as soon as enough users are present.
#pragma once

#include <boost/container/static_vector.hpp>
#include <optional>

#include "common/base/ids.hpp"
#include "common/base/time.hpp"
#include "proto/state.hpp"
#include "server/room/room.hpp"
#include "tandem/control.pb.h"

namespace tandem::server {

/// Counts the users whose hands are present, and sets the time of the common start.
///
/// Model   When the hands of RoomStartSettings::users users are present, the start is set to now + countdown. It is
///         cancelled if a user leaves before that time and too few users remain. Once the start time has passed, the
///         start remains valid until the last user leaves.
/// Thread  io
class RoomStart {
 public:
  explicit RoomStart(const RoomStartSettings& settings) : settings_(settings) {}

  /// Returns whether the room has a common start. Otherwise each hand starts when its client does, and the functions
  /// below have no effect.
  bool is_used() const { return settings_.users > 0; }
  /// Reports that the first valid handle of a manipulator has arrived. Repeated calls for a user have no effect.
  /// Out     whether message() has changed
  bool add(UserId user, ServerTime now);
  /// Removes a user who has left.
  /// Out     whether message() has changed
  bool remove(UserId user, ServerTime now);
  /// Returns the time of the common start, or nothing while users are missing.
  std::optional<ServerTime> starts_at() const { return starts_at_; }
  wire::RoomStart message() const;

 private:
  RoomStartSettings settings_;
  boost::container::static_vector<UserId, proto::kMaxUsers> present_;
  std::optional<ServerTime> starts_at_;
};

}  // namespace tandem::server
