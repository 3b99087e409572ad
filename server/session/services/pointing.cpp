#include <map>

#include "common/net/token_bucket.hpp"
#include "proto/placement.hpp"
#include "server/session/limits.hpp"
#include "server/session/services/services.hpp"

namespace tandem::server {
namespace {

class Pointing final : public SessionService {
 public:
  explicit Pointing(ServiceHost& host) : host_(host) {}
  std::vector<Case> cases() const override { return {Case::kPoint}; }
  void handle(SessionUser& user, const wire::ClientControl& message) override;
  void on_left(SessionUser& user) override { of_users_.erase(&user); }

 private:
  ServiceHost& host_;
  std::map<const SessionUser*, net::TokenBucket> of_users_;
  std::map<const Room*, net::TokenBucket> of_rooms_;
};

/// Sends the pointed position to all users of the room. Their clients display it and briefly push the hand towards it.
void Pointing::handle(SessionUser& user, const wire::ClientControl& message) {
  const wire::Point& point = message.point();
  const auto refuse = [&](wire::ErrorCode code, const char* text) {
    host_.refuse_request(user, message.request(), code, text);
  };
  if (!user.seat.is_manipulator()) {
    refuse(wire::ERROR_NOT_ALLOWED, "observers do not point; join as a manipulator");
  } else if (!proto::is_place(point.place()) || !proto::is_place(point.place_w())) {
    refuse(wire::ERROR_BAD_VALUE, "a place is three numbers in metres, -1000 to 1000");
  } else if (point.body() > user.room().scene().world.bodies.size()) {
    refuse(wire::ERROR_UNKNOWN_BODY, "no body has that number here");
  } else if (!of_users_.try_emplace(&user, kUserPointRate).first->second.try_consume(1, host_.now())) {
    refuse(wire::ERROR_NOT_ALLOWED, "you point too often: one place a second, two at once; try again later");
  } else if (!of_rooms_.try_emplace(&user.room(), kPointRate).first->second.try_consume(1, host_.now())) {
    refuse(wire::ERROR_NOT_ALLOWED, kRoomBusy);
  } else {
    wire::ServerControl pointed;
    pointed.mutable_pointed()->set_user(user.seat.user.value);
    *pointed.mutable_pointed()->mutable_point() = point;
    host_.send_to_room(user.room(), pointed, user.seat.user, message.request());
  }
}

}  // namespace

std::unique_ptr<SessionService> make_pointing(ServiceHost& host) {
  return std::make_unique<Pointing>(host);
}

}  // namespace tandem::server
