#include "server/session/services/services.hpp"
#include "server/session/session_answers.hpp"

namespace tandem::server {
namespace {

wire::ErrorCode error_of(physics::GrabResult result) {
  switch (result) {
    case physics::GrabResult::kUnknownBody:
      return wire::ERROR_UNKNOWN_BODY;
    case physics::GrabResult::kNotGraspable:
      return wire::ERROR_NOT_GRASPABLE;
    case physics::GrabResult::kOutOfReach:
      return wire::ERROR_OUT_OF_REACH;
    case physics::GrabResult::kAlreadyHolding:
      return wire::ERROR_ALREADY_HOLDING;
    case physics::GrabResult::kBusy:
      return wire::ERROR_NOT_ALLOWED;
    case physics::GrabResult::kGrabbed:
      break;
  }
  return wire::ERROR_UNSPECIFIED;
}

const char* text_of(physics::GrabResult result) {
  switch (result) {
    case physics::GrabResult::kUnknownBody:
      return "there is no such body to grab";
    case physics::GrabResult::kNotGraspable:
      return "that body cannot be grabbed (graspable is false in the scene)";
    case physics::GrabResult::kOutOfReach:
      return "no graspable body within limits.grab_reach_m of the tool";
    case physics::GrabResult::kAlreadyHolding:
      return "the tool already holds a body; release it first";
    case physics::GrabResult::kBusy:
      return kRoomBusy;
    case physics::GrabResult::kGrabbed:
      break;
  }
  return "refused";
}

wire::ServerControl grab_answer(const RoomEvent& event) {
  if (event.kind == RoomEvent::Kind::kGrabRefused) {
    return error_answer(event.request, error_of(event.refusal), text_of(event.refusal));
  }
  wire::ServerControl answer;
  answer.set_request(event.request);
  if (event.kind == RoomEvent::Kind::kGrabbed) {
    answer.mutable_grabbed()->set_body(event.body.value);
  } else {
    answer.mutable_released()->set_body(event.body.value);
  }
  return answer;
}

wire::ServerControl body_returned(BodyId body) {
  wire::ServerControl message;
  message.mutable_body_returned()->set_body(body.value);
  return message;
}

class Grasping final : public SessionService {
 public:
  explicit Grasping(ServiceHost& host) : host_(host) {}
  std::vector<Case> cases() const override { return {Case::kGrab, Case::kRelease}; }
  void handle(SessionUser& user, const wire::ClientControl& message) override;
  void on_poll() override;

 private:
  ServiceHost& host_;
};

/// Passes the request to the room. on_poll() sends the answer when the room has served it.
void Grasping::handle(SessionUser& user, const wire::ClientControl& message) {
  const std::uint32_t request = message.request();
  if (!has_tool(user.seat.role))
    return host_.refuse_request(user, request, wire::ERROR_NOT_ALLOWED, "an observer cannot grab");
  const bool was_posted = message.has_grab() ? user.seats->grab(user.seat, BodyId{message.grab().body()}, request)
                                             : user.seats->release(user.seat, request);
  if (!was_posted) host_.refuse_request(user, request, wire::ERROR_NOT_ALLOWED, kRoomBusy);
}

void Grasping::on_poll() {
  RoomEvent event;
  for (const auto& seats : host_.rooms()) {
    Room& room = seats->room();
    while (room.next_event(event)) {
      if (event.kind == RoomEvent::Kind::kReturned) {
        host_.send_to_room(room, body_returned(event.body));
      } else if (SessionUser* const user = host_.find_user(room, event.user)) {
        host_.send(*user, grab_answer(event));
      }
    }
  }
}

}  // namespace

std::unique_ptr<SessionService> make_grasping(ServiceHost& host) {
  return std::make_unique<Grasping>(host);
}

}  // namespace tandem::server
