#include "server/session/services/service.hpp"

#include <algorithm>

#include "server/session/session_answers.hpp"
#include "server/session/user_name.hpp"

namespace tandem::server {

std::string SessionUser::label() const {
  return "user " + std::to_string(seat.user.value) + " " + quoted(name);
}

SessionUser* ServiceHost::find_user(const Room& room, UserId id) const {
  const std::vector<SessionUser*> users = users_of(room);
  const auto found = std::ranges::find_if(users, [id](const SessionUser* user) { return user->seat.user == id; });
  return found == users.end() ? nullptr : *found;
}

void ServiceHost::refuse_request(SessionUser& user, std::uint32_t request, wire::ErrorCode code,
                                 const std::string& text) {
  send(user, error_answer(request, code, text));
}

void ServiceHost::send_to_room(const Room& room, wire::ServerControl message, UserId requester, std::uint32_t request) {
  for (SessionUser* user : users_of(room)) {
    message.set_request(user->seat.user == requester ? request : 0);
    send(*user, message);
  }
}

}  // namespace tandem::server
