#include "server/session/services/services.hpp"
#include "server/session/session_answers.hpp"

namespace tandem::server {
namespace {

class Moderation final : public SessionService {
 public:
  Moderation(ServiceHost& host, PoseKeeper* poses) : host_(host), poses_(poses) {}
  std::vector<Case> cases() const override { return {Case::kKick, Case::kResetRoom}; }
  void handle(SessionUser& user, const wire::ClientControl& message) override;

 private:
  void kick(SessionUser& user, const wire::ClientControl& message);
  void reset(SessionUser& user, std::uint32_t request);

  ServiceHost& host_;
  PoseKeeper* poses_;
};

void Moderation::handle(SessionUser& user, const wire::ClientControl& message) {
  if (message.has_kick()) {
    kick(user, message);
  } else {
    reset(user, message.request());
  }
}

/// Removes a user from the room. If tokens are required, the kicked user can join again only with a new token.
void Moderation::kick(SessionUser& user, const wire::ClientControl& message) {
  SessionUser* const kicked = host_.find_user(user.room(), UserId{message.kick().user()});
  if (!user.is_operator()) {
    host_.refuse_request(user, message.request(), wire::ERROR_NOT_ALLOWED, "only the room's operator may kick");
  } else if (kicked == nullptr || kicked == &user) {
    host_.refuse_request(user, message.request(), wire::ERROR_BAD_VALUE, "no other user of that number is here");
  } else {
    wire::ServerControl answer = user_left(kicked->seat, wire::DISCONNECT_KICKED);
    host_.end(*kicked, wire::DISCONNECT_KICKED, "kicked by the room's operator");
    answer.set_request(message.request());
    host_.send(user, answer);
  }
}

void Moderation::reset(SessionUser& user, std::uint32_t request) {
  if (!user.is_operator()) {
    host_.refuse_request(user, request, wire::ERROR_NOT_ALLOWED,
                         "only the room's operator may reset it; join with --role operator");
  } else if (!user.seats->reset(user.seat, host_.now())) {
    host_.refuse_request(user, request, wire::ERROR_NOT_ALLOWED, kRoomBusy);
  } else {
    if (poses_ != nullptr) poses_->cancel(user.room(), std::nullopt, "the operator has reset the room");
    host_.log("reset", user.label() + " reset room " + user.room().name());
    wire::ServerControl news;
    news.mutable_room_reset()->set_user(user.seat.user.value);
    host_.send_to_room(user.room(), news, user.seat.user, request);
  }
}

}  // namespace

std::unique_ptr<SessionService> make_moderation(ServiceHost& host, PoseKeeper* poses) {
  return std::make_unique<Moderation>(host, poses);
}

}  // namespace tandem::server
