// Names of the session's states.
#include <array>

#include "client/session/session.hpp"

namespace tandem::client {

std::string_view name_of(SessionState state) {
  constexpr std::array<std::string_view, 6> kNames{"connecting", "greeting", "joining", "active", "waiting", "ended"};
  return kNames.at(static_cast<std::size_t>(state));
}

}  // namespace tandem::client
