// Events of a client's session, one type each, in the order in which they happened. Lasting state is not here but in
// the session (ClientIoSnapshot for a live client).
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
/// Another user is in the room; also sent after a join for those that were there before.
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
/// Answer to a RequestPose with this tag, once for each: the server's message with that request's number, or an error
/// if the connection ended first.
struct PoseAnswered {
  std::uint32_t tag = 0;
  wire::ServerControl answer;
  wire::PoseProgress minimising;  ///< last progress of this user's own minimisations
};
/// News of the room, as text for the user.
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

/// The event as a printable line for a log; empty for one that is of no interest there.
std::string log_line(const Event& event);

}  // namespace tandem::client
