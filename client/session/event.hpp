// Events of a client's session, with one type for each event. They are reported in the order in which they happened.
// The current state is not an event; the session provides it (ClientIoSnapshot for a live client).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>

#include "client/session/session_status.hpp"
#include "common/base/ids.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

namespace event {

/// The session has entered another state.
struct StateChanged {
  SessionState state = SessionState::kConnecting;
  std::string why;  ///< SessionStatus::why
};
/// The user has joined a room, for the first time or again.
struct Joined {
  std::shared_ptr<const wire::Joined> answer;
};
/// Another user is in the room. After a join, this event is also sent for each user who was already in the room.
struct UserJoined {
  wire::UserJoined user;
};
struct UserLeft {
  UserId user;
};
/// The user's own tool has grabbed or released a body.
struct Grabbed {
  BodyId body;
};
struct Released {
  BodyId body;
};
/// A coefficient or the law of the coupling has changed.
struct ParameterSet {
  wire::ParameterSet parameter;
};
/// The server has refused a request.
struct Refused {
  wire::Error error;
};
/// Result of the RequestPose with this tag; sent once. It is the server's answer to the request, or an error if the
/// connection ended before the answer.
struct PoseAnswered {
  std::uint32_t tag = 0;
  wire::ServerControl answer;
  wire::PoseProgress minimising;  ///< last progress of this user's own minimisations
};
/// A change in the room, as text for the user.
struct News {
  std::string text;
};
/// A line for a log.
struct Log {
  std::string text;
};

}  // namespace event

using Event =
    std::variant<event::StateChanged, event::Joined, event::UserJoined, event::UserLeft, event::Grabbed,
                 event::Released, event::ParameterSet, event::Refused, event::PoseAnswered, event::News, event::Log>;

/// Returns the event as a printable line for a log; empty for events that are not logged.
std::string log_line(const Event& event);

}  // namespace tandem::client
