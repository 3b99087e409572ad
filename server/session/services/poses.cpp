#include <algorithm>
#include <map>

#include "common/net/token_bucket.hpp"
#include "server/session/limits.hpp"
#include "server/session/services/services.hpp"
#include "server/session/user_name.hpp"

namespace tandem::server {
namespace {

constexpr const char* kMinimisingCancelled = "the minimisation was cancelled";

std::string rate_text(const net::Rate& rate) {
  return std::to_string(static_cast<int>(rate.per_second)) + " poses a second, " +
         std::to_string(static_cast<int>(rate.at_once)) + " at once";
}

class Poses final : public SessionService {
 public:
  Poses(ServiceHost& host, PoseKeeper* keeper) : host_(host), keeper_(keeper) {}
  std::vector<Case> cases() const override { return {Case::kAskPose}; }
  void handle(SessionUser& user, const wire::ClientControl& message) override;
  void on_joined(SessionUser& user, const wire::JoinRoom& granted) override;
  void on_left(SessionUser& user) override;
  void on_poll() override;
  void begin_stop() override;
  bool owes_answers() const override { return keeper_ != nullptr && keeper_->unanswered() > 0; }
  void refuse_unanswered() override;

 private:
  /// Consumes one token of the bucket of a user or a room. Returns false if the bucket is empty.
  template <class Key>
  bool consume(std::map<const Key*, net::TokenBucket>& buckets, const Key& count, const net::Rate& rate) {
    return buckets.try_emplace(&count, rate).first->second.try_consume(1, host_.now());
  }
  std::string edit_problem(const SessionUser& user, const wire::AskPose& edit) const;
  void cancel_minimising(SessionUser& user, std::uint32_t request);
  bool deliver(const Room& room, UserId requester, const wire::ServerControl& answer, const RoomCommand* placing);

  ServiceHost& host_;
  PoseKeeper* keeper_;
  std::map<const SessionUser*, net::TokenBucket> of_users_;
  std::map<const Room*, net::TokenBucket> of_rooms_;
};

/// Passes a permitted request to PoseKeeper. on_poll() sends the answer.
void Poses::handle(SessionUser& user, const wire::ClientControl& message) {
  const Room& room = user.room();
  const wire::AskPose& wanted = message.ask_pose();
  const std::string& name = wanted.name();
  const auto refuse = [&](auto code, const std::string& text) {
    host_.refuse_request(user, message.request(), code, text);
  };
  if (keeper_ == nullptr || !keeper_->has_molecules(room)) {
    refuse(wire::ERROR_NOT_ALLOWED,
           "poses are kept in rooms of two molecules, of 300 million pairs of atoms at most; there are none here");
  } else if (!user.seat.is_manipulator()) {
    refuse(wire::ERROR_NOT_ALLOWED, "observers keep no poses; join as a manipulator");
  } else if ((!name.empty() || wanted.kind() == wire::AskPose::RENAME) && !is_acceptable_user_name(name)) {
    refuse(wire::ERROR_BAD_NAME, "a pose's name is 1 to 64 bytes of printable UTF-8; choose another");
  } else if (wanted.kind() == wire::AskPose::CANCEL) {
    cancel_minimising(user, message.request());
  } else if (const std::string problem = edit_problem(user, wanted); !problem.empty()) {
    refuse(wire::ERROR_NOT_ALLOWED, problem);
  } else if (!consume(of_users_, user, kUserPoseRate)) {
    refuse(wire::ERROR_NOT_ALLOWED, "a user may request at most " + rate_text(kUserPoseRate) + "; wait a second");
  } else if (!consume(of_rooms_, room, kPoseRate)) {
    refuse(wire::ERROR_NOT_ALLOWED,
           "the users of a room may request at most " + rate_text(kPoseRate) + " together; wait a second");
  } else if (const std::string why = keeper_->submit(room, user.seat.user, user.name, message.request(), wanted);
             !why.empty()) {
    refuse(wire::ERROR_NOT_ALLOWED, why);
  }
}

void Poses::on_joined(SessionUser& user, const wire::JoinRoom& /*granted*/) {
  if (keeper_ == nullptr) return;
  for (const wire::KeptPose& pose : keeper_->kept(user.room())) {
    wire::ServerControl message;
    *message.mutable_kept_pose() = pose;
    host_.send(user, message);
  }
}

void Poses::on_left(SessionUser& user) {
  of_users_.erase(&user);
  if (keeper_ != nullptr) keeper_->forget(user.room(), user.seat.user);
}

/// Returns the reason why the user may not delete or rename a pose; empty if they may. While the user who saved a pose
/// is present, only that user and the operator may edit it. Once that user has left, everybody may, because otherwise
/// nobody could free space in a full list.
std::string Poses::edit_problem(const SessionUser& user, const wire::AskPose& edit) const {
  const bool edits = edit.kind() == wire::AskPose::DELETE || edit.kind() == wire::AskPose::RENAME;
  if (!edits || user.is_operator()) return {};
  const std::vector<wire::KeptPose>& kept = keeper_->kept(user.room());
  const auto pose = std::ranges::find(kept, edit.number(), &wire::KeptPose::number);
  if (pose == kept.end() || pose->user_name() == user.name) return {};
  const std::vector<SessionUser*> users = host_.users_of(user.room());
  if (std::ranges::find(users, pose->user_name(), &SessionUser::name) == users.end()) return {};
  return pose->user_name() + " kept that pose and is here; only " + pose->user_name() +
         " or the room's operator may delete or rename it";
}

void Poses::cancel_minimising(SessionUser& user, std::uint32_t request) {
  const bool is_operator = user.is_operator();
  const auto requester = is_operator ? std::nullopt : std::optional(user.seat.user);
  if (!keeper_->cancel(user.room(), requester, kMinimisingCancelled)) {
    return host_.refuse_request(user, request, wire::ERROR_NOT_ALLOWED,
                                is_operator
                                    ? "no minimisation is under way here"
                                    : "no minimisation of yours is under way; only the user who requested one, or the "
                                      "room's operator, can cancel it");
  }
  wire::ServerControl answer;
  answer.set_request(request);
  answer.mutable_pose_progress()->set_user(user.seat.user.value);
  answer.mutable_pose_progress()->set_is_over(true);
  host_.send(user, answer);
}

void Poses::on_poll() {
  if (keeper_ == nullptr) return;
  keeper_->deliver([this](const Room& room, UserId requester, const wire::ServerControl& answer,
                          const RoomCommand* placing) { return deliver(room, requester, answer, placing); });
}

/// Sends an answer of PoseKeeper to its recipients, and passes the command `placing` to the room if it is not null.
/// Returns false if its requester has left or the room's queue is full (see PoseKeeper::deliver()).
bool Poses::deliver(const Room& room, UserId requester, const wire::ServerControl& answer, const RoomCommand* placing) {
  SessionUser* const user = host_.find_user(room, requester);
  const bool is_for_requester = placing != nullptr || answer.has_error();
  if (user == nullptr && is_for_requester) return false;
  if (placing != nullptr && !user->seats->place(user->seat, *placing)) {
    host_.refuse_request(*user, answer.request(), wire::ERROR_NOT_ALLOWED, kRoomBusy);
    return false;
  }
  if (answer.has_error()) {
    host_.send(*user, answer);
  } else {
    host_.send_to_room(room, answer, requester, answer.request());
  }
  return true;
}

void Poses::begin_stop() {
  if (keeper_ != nullptr) keeper_->begin_stop();
}

/// Refuses all unanswered requests, so that a stop is not delayed by a hung disk or a long evaluation.
void Poses::refuse_unanswered() {
  if (keeper_ == nullptr) return;
  on_poll();
  keeper_->refuse_unanswered([this](const Room& room, UserId requester, std::uint32_t request) {
    if (SessionUser* const user = host_.find_user(room, requester))
      host_.refuse_request(
          *user, request, wire::ERROR_NOT_ALLOWED,
          "the server stops and does not wait for this any longer; check whether it was done when it runs "
          "again");
  });
}

}  // namespace

std::unique_ptr<SessionService> make_poses(ServiceHost& host, PoseKeeper* poses) {
  return std::make_unique<Poses>(host, poses);
}

}  // namespace tandem::server
