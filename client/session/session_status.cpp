// How the session speaks of itself, and of what the wire said.
#include <array>

#include "client/session/session.hpp"

namespace tandem::client {

std::string printable(std::string text) {
  constexpr std::size_t kMaxTextBytes = 400;
  if (text.size() > kMaxTextBytes) text.resize(kMaxTextBytes);
  for (char& character : text) {
    const auto byte = static_cast<unsigned char>(character);
    if (byte < 0x20 || byte == 0x7F) character = '?';
  }
  return text;
}

std::string_view name_of(SessionState state) {
  constexpr std::array<std::string_view, 6> kNames{"connecting", "greeting", "joining", "active", "waiting", "ended"};
  return kNames.at(static_cast<std::size_t>(state));
}

}  // namespace tandem::client
