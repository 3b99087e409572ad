// Requests of users about poses of a room's molecules, and their answers (recording/pose_keeper.hpp).
#include <algorithm>

#include "server/session/session_hub_impl.hpp"
#include "server/session/user_name.hpp"

namespace tandem::server {
namespace {

constexpr const char* kMinimisingCancelled = "the minimisation was cancelled";

std::string rate_text(const net::Rate& rate) {
  return std::to_string(static_cast<int>(rate.per_second)) + " poses a second, " +
         std::to_string(static_cast<int>(rate.at_once)) + " at once";
}

}  // namespace

/// Starts a request; send_pose_answers() sends the answer.
void SessionHub::Impl::ask_pose(Connection& connection, const wire::ClientControl& message) {
  const Room& room = connection.seats->room();
  const wire::AskPose& request = message.ask_pose();
  const std::string& name = request.name();
  const auto refuse_with = [&](auto code, auto text) { send(connection, error_answer(message.request(), code, text)); };
  if (settings.poses == nullptr || !settings.poses->has_molecules(room)) {
    refuse_with(wire::ERROR_NOT_ALLOWED,
                "poses are kept in rooms of two molecules, of 300 million pairs of atoms at most; there are none here");
  } else if (!connection.seat.is_manipulator()) {
    refuse_with(wire::ERROR_NOT_ALLOWED, "observers keep no poses; join as a manipulator");
  } else if ((!name.empty() || request.kind() == wire::AskPose::RENAME) && !is_acceptable_user_name(name)) {
    refuse_with(wire::ERROR_BAD_NAME, "a pose's name is 1 to 64 bytes of printable UTF-8; choose another");
  } else if (request.kind() == wire::AskPose::CANCEL) {
    cancel_minimising(connection, message.request());
  } else if (const std::string problem = pose_edit_problem(connection, request); !problem.empty()) {
    refuse_with(wire::ERROR_NOT_ALLOWED, problem);
  } else if (!connection.poses.has_some(called_at) || !connection.poses.consume(1, called_at)) {
    refuse_with(wire::ERROR_NOT_ALLOWED, "a user may request at most " + rate_text(kUserPoseRate) + "; wait a second");
  } else if (!connection.seats->may_request_pose(called_at)) {
    refuse_with(wire::ERROR_NOT_ALLOWED,
                "the users of a room may request at most " + rate_text(kPoseRate) + " together; wait a second");
  } else if (const std::string why =
                 settings.poses->submit(room, connection.seat.user, connection.user_name, message.request(), request);
             !why.empty()) {
    refuse_with(wire::ERROR_NOT_ALLOWED, why);
  }
}

/// A kept pose belongs to the user name that kept it. After that user has left, everybody may edit it; otherwise a room
/// could fill up for good.
std::string SessionHub::Impl::pose_edit_problem(const Connection& connection, const wire::AskPose& request) const {
  const bool edits = request.kind() == wire::AskPose::DELETE || request.kind() == wire::AskPose::RENAME;
  if (!edits || connection.seat.role == UserRole::kOperator) return {};
  const std::vector<wire::KeptPose>& kept = settings.poses->kept(connection.seats->room());
  const auto pose = std::ranges::find(kept, request.number(), &wire::KeptPose::number);
  if (pose == kept.end() || pose->user_name() == connection.user_name) return {};
  const bool is_here = std::ranges::any_of(connections, [&](const auto& entry) {
    return entry.second->is_in(*connection.seats) && entry.second->user_name == pose->user_name();
  });
  if (!is_here) return {};
  return pose->user_name() + " kept that pose and is here; only " + pose->user_name() +
         " or the room's operator may delete or rename it";
}

void SessionHub::Impl::cancel_minimising(Connection& connection, std::uint32_t request) {
  const bool is_operator = connection.seat.role == UserRole::kOperator;
  const auto requester = is_operator ? std::nullopt : std::optional(connection.seat.user);
  if (!settings.poses->cancel(connection.seats->room(), requester, kMinimisingCancelled)) {
    return send(connection, error_answer(request, wire::ERROR_NOT_ALLOWED,
                                         is_operator ? "no minimisation is under way here"
                                                     : "no minimisation of yours is under way; only the user who "
                                                       "requested one, or the room's operator, can cancel it"));
  }
  wire::ServerControl answer;
  answer.set_request(request);
  answer.mutable_pose_progress()->set_user(connection.seat.user.value);
  answer.mutable_pose_progress()->set_is_over(true);
  send(connection, answer);
}

/// Refuses open requests at a stop, so that a hung disk or a long evaluation does not delay it.
void SessionHub::Impl::refuse_unanswered_poses() {
  if (settings.poses == nullptr) return;
  send_pose_answers();
  settings.poses->refuse_unanswered([this](const Room& room, UserId user, std::uint32_t request) {
    for (const auto& [handle, connection] : connections) {
      const bool is_asker = connection->state == ConnectionState::kActive && &connection->seats->room() == &room &&
                            connection->seat.user == user;
      if (is_asker)
        send(*connection, error_answer(request, wire::ERROR_NOT_ALLOWED,
                                       "the server stops and does not wait for this any longer; check whether it was "
                                       "done when it runs again"));
    }
  });
}

void SessionHub::Impl::send_pose_answers() {
  if (settings.poses == nullptr) return;
  settings.poses->deliver(
      [this](const Room& room, UserId user, const wire::ServerControl& answer, const RoomCommand* placing) {
        const auto asker = std::ranges::find_if(connections, [&](const auto& entry) {
          const Connection& connection = *entry.second;
          return connection.state == ConnectionState::kActive && &connection.seats->room() == &room &&
                 connection.seat.user == user;
        });
        const bool is_for_asker = placing != nullptr || answer.has_error();
        if (asker == connections.end() && is_for_asker) return false;  // the user has left
        if (placing != nullptr && !asker->second->seats->place(asker->second->seat, *placing)) {
          send(*asker->second, error_answer(answer.request(), wire::ERROR_NOT_ALLOWED, kRoomBusy));
          return false;
        }
        if (answer.has_error()) {
          send(*asker->second, answer);
        } else {
          send_to_room(room, user, answer.request(), answer);
        }
        return true;
      });
}

}  // namespace tandem::server
