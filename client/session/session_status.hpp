// State of a session, as text and for programs.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tandem::client {

enum class SessionState : std::uint8_t { kConnecting, kGreeting, kJoining, kActive, kWaiting, kEnded };
std::string_view name_of(SessionState state);

/// State of the session, and why it is not active, as text for the user: the last error, goodbye or lost connection.
struct SessionStatus {
  SessionState state = SessionState::kConnecting;
  std::string why;
  /// Set in kEnded if the set-up is wrong (version, room, name), so that a retry would fail again.
  bool is_setup_error = false;
};

}  // namespace tandem::client
