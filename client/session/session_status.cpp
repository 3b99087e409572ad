// Converts session states to names, and session events to lines of a log.
#include "client/session/session_status.hpp"

#include <array>

#include "client/session/event.hpp"
#include "common/net/text.hpp"

namespace tandem::client {

std::string_view name_of(SessionState state) {
  constexpr std::array<std::string_view, 6> kNames{"connecting", "greeting", "joining", "active", "waiting", "ended"};
  return kNames.at(static_cast<std::size_t>(state));
}

namespace {

std::string line_of(const event::Joined& event) {
  return "joined \"" + event.answer->scene().name() + "\" as user " + std::to_string(event.answer->user());
}
std::string line_of(const event::UserJoined& event) {
  return "user " + std::to_string(event.user.user()) + " \"" + event.user.name() + "\" is here";
}
std::string line_of(const event::UserLeft& event) {
  return "user " + std::to_string(event.user.value) + " left";
}
std::string line_of(const event::Grabbed& event) {
  return "grabbed body " + std::to_string(event.body.value);
}
std::string line_of(const event::Released& event) {
  return "released body " + std::to_string(event.body.value);
}
std::string line_of(const event::News& event) {
  return event.text;
}
std::string line_of(const event::Log& event) {
  return event.text;
}
/// Returns an empty text for all other events. The session emits a second event for each of them (News or Log), and
/// that event has the text.
template <class Other>
std::string line_of(const Other& /*event*/) {
  return {};
}

}  // namespace

std::string log_line(const Event& event) {
  return net::printable(std::visit([](const auto& each) { return line_of(each); }, event));
}

}  // namespace tandem::client
