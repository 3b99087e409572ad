// Events of a client's session, one type per event, reported in the order of occurrence. The present state is not
// reported by events. The session provides it by functions, and a live client by ClientIoSnapshot.
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

/// The session has entered a new state.
struct StateChanged {
  SessionState state = SessionState::kConnecting;
  std::string why;  ///< reason, see SessionStatus::why
};
/// The user has joined a room, for the first time or after a lost connection.
struct Joined {
  std::shared_ptr<const wire::Joined> answer;
};
/// Another user is in the room. After the own join, the event is emitted for each user who was already in the room.
struct UserJoined {
  wire::UserJoined user;
};
struct UserLeft {
  UserId user;
};
/// This user's tool has grabbed a body (Grabbed) or released it (Released).
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
/// Result of the RequestPose command with this tag, emitted exactly once. `answer` is the server's answer, or an error
/// if the connection ended before it.
struct PoseAnswered {
  std::uint32_t tag = 0;
  wire::ServerControl answer;
  wire::PoseProgress minimising;  ///< last progress of the minimisations that this user started
};
/// A change in the room, as text for the user.
struct News {
  std::string text;
};
/// A line of text for a log.
struct Log {
  std::string text;
};

}  // namespace event

using Event =
    std::variant<event::StateChanged, event::Joined, event::UserJoined, event::UserLeft, event::Grabbed,
                 event::Released, event::ParameterSet, event::Refused, event::PoseAnswered, event::News, event::Log>;

/// Returns the event as a printable line for a log, or an empty text for an event that is not logged.
std::string log_line(const Event& event);

}  // namespace tandem::client
