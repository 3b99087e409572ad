#include "server/room/room_start.hpp"

#include <algorithm>

namespace tandem::server {

bool RoomStart::add(UserId user, ServerTime now) {
  if (!is_used() || std::ranges::find(present_, user) != present_.end() || present_.size() == present_.capacity()) {
    return false;
  }
  present_.push_back(user);
  if (starts_at_) return false;
  if (present_.size() >= settings_.users) starts_at_ = now + settings_.countdown;
  return true;
}

bool RoomStart::remove(UserId user, ServerTime now) {
  const auto found = std::ranges::find(present_, user);
  if (found == present_.end()) return false;
  present_.erase(found);
  const bool is_counting_down = starts_at_ && now < *starts_at_;
  const bool is_withdrawn = is_counting_down && present_.size() < settings_.users;
  const bool is_empty = present_.empty();
  if (starts_at_ && !is_withdrawn && !is_empty) return false;
  starts_at_.reset();
  return true;
}

wire::RoomStart RoomStart::message() const {
  wire::RoomStart message;
  if (starts_at_) {
    message.set_starts_server_ns(static_cast<std::uint64_t>(starts_at_->time_since_epoch().count()));
  } else {
    message.set_awaited(static_cast<std::uint32_t>(settings_.users - std::min(settings_.users, present_.size())));
  }
  return message;
}

}  // namespace tandem::server
