// State of a session, and text about the state for the user.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tandem::client {

enum class SessionState : std::uint8_t { kConnecting, kGreeting, kJoining, kActive, kWaiting, kEnded };
std::string_view name_of(SessionState state);

/// State of the session. Unless it is active, `why` gives the reason as text for the user: the last error, goodbye
/// message or loss of the connection.
struct SessionStatus {
  SessionState state = SessionState::kConnecting;
  std::string why;
  /// True if the session has ended because of a wrong set-up (version, room, name), which a retry cannot cure.
  bool is_setup_error = false;
};

}  // namespace tandem::client
