#include <algorithm>
#include <utility>

#include "proto/coupling_fields.hpp"
#include "server/room/wire_role.hpp"
#include "server/session/session_hub_impl.hpp"
#include "server/session/user_name.hpp"

namespace tandem::server {
namespace {

/// Returns the first bound that is out of range; null if all present bounds are in range.
const proto::CouplingField* find_bad_bound(const wire::Coupling& bounds) {
  for (const proto::CouplingField& field : proto::kCouplingFields) {
    if ((bounds.*field.has)() && !field.accepts((bounds.*field.get)())) return &field;
  }
  return nullptr;
}

/// Finds a room by name; null if there is none. An empty name means the only room of the server.
RoomSeats* find_room(const std::vector<std::unique_ptr<RoomSeats>>& rooms, const std::string& name) {
  if (name.empty() && rooms.size() == 1) return rooms.front().get();
  for (const auto& seats : rooms) {
    if (seats->room().name() == name) return seats.get();
  }
  return nullptr;
}

std::string names_of(const std::vector<std::unique_ptr<RoomSeats>>& rooms) {
  std::string names;
  for (const auto& seats : rooms) names += (names.empty() ? "" : ", ") + seats->room().name();
  return names;
}

}  // namespace

void SessionHub::Impl::join(Connection& connection, const wire::ClientControl& message) {
  wire::ClientControl granted = message;
  if (admit_user(connection, message.request(), *granted.mutable_join())) join_as_granted(connection, granted);
}

/// Checks a join by Admission. If it is admitted, limits `wanted` to the granted rights and returns true. Otherwise
/// refuses the connection and returns false.
bool SessionHub::Impl::admit_user(Connection& connection, std::uint32_t request, wire::JoinRoom& wanted) {
  if (!admission) return true;
  const auto exported =
      transport.exported(connection.handle, secure::kResumeExport, proto::seal_context(connection.id));
  if (const auto refusal = admission->admit(wanted, exported, called_at, connection.ticket)) {
    refuse_connection(connection, request, refusal->code, refusal->text);
    return false;
  }
  if (!connection.ticket.is_resumed) return true;
  // The server may not have noticed the loss of the user's old connection yet, so the old connection is ended here.
  for (const auto& [handle, other] : connections) {
    if (other->credential != connection.ticket.id || other->state != ConnectionState::kActive) continue;
    end(*other, wire::DISCONNECT_RESUMED, "the user rejoined on another connection");
  }
  return true;
}

void SessionHub::Impl::join_as_granted(Connection& connection, const wire::ClientControl& message) {
  const wire::JoinRoom& wanted = message.join();
  const Admission::Ticket& ticket = connection.ticket;
  RoomSeats* seats = find_room(room_seats, wanted.room());
  const auto refuse = [&](wire::ErrorCode code, const std::string& text) {
    refuse_connection(connection, message.request(), code, text);
  };
  if (!is_acceptable_user_name(wanted.user_name())) {
    refuse(wire::ERROR_BAD_NAME,
           "a user name is 1 to 64 bytes of printable UTF-8, without invisible characters, its blanks single spaces; "
           "choose another");
  } else if (!role_of(wanted.role())) {
    refuse(wire::ERROR_BAD_VALUE, "the role must be manipulator, operator, observer or signal");
  } else if (seats == nullptr) {
    refuse(wire::ERROR_UNKNOWN_ROOM,
           (wanted.room().empty() ? "several rooms are open, name one" : "there is no room " + quoted(wanted.room())) +
               "; rooms here: " + names_of(room_seats));
  } else if (wanted.role() == wire::ROLE_OPERATOR && seats->has_operator()) {
    refuse(wire::ERROR_NOT_ALLOWED, "room " + seats->room().name() + " has an operator; join as a manipulator");
  } else if (wanted.role() == wire::ROLE_SIGNAL && seats->room().scene().description.game().signals().empty()) {
    refuse(wire::ERROR_NOT_ALLOWED,
           "room " + seats->room().name() + " has no game with signals; add game.signals to its scene");
  } else if (!(wanted.deadband() >= 0 && wanted.deadband() <= net::kMaxDeadband)) {  // also refuses NaN
    refuse(wire::ERROR_BAD_VALUE, "the deadband must be 0 to 0.5");
  } else if (const proto::CouplingField* bad = find_bad_bound(wanted.coupling_bounds())) {
    refuse(wire::ERROR_BAD_VALUE, "coupling_bounds: " + std::string(bad->name) + " must be " +
                                      std::to_string(bad->low) + " to " + std::to_string(bad->high) + ", or absent");
  } else if (!seats->has_place(*role_of(wanted.role()))) {
    refuse(wire::ERROR_ROOM_FULL, "room " + seats->room().name() + " is full: no free place for " +
                                      (wanted.role() == wire::ROLE_SIGNAL   ? "another source of signals"
                                       : !has_tool(*role_of(wanted.role())) ? "an observer; wait until a user leaves"
                                       : seats->has_place(UserRole::kObserver)
                                           ? "a manipulator; join as an observer, or wait until a user leaves"
                                           : "a manipulator; wait until a user leaves"));
  } else if (admission && ticket.uses_token() && admission->use_of(ticket) != InvitationLedger::Use::kWritten) {
    hold(connection, message);
  } else if (wanted.role() == wire::ROLE_SIGNAL) {
    admit_source(connection, message, *seats);
  } else {
    assign_seat(connection, message, *seats);
  }
}

/// Admits a source of signals: it has a user id, but no seat, no state stream and no news of the room.
void SessionHub::Impl::admit_source(Connection& connection, const wire::ClientControl& message, RoomSeats& seats) {
  const wire::JoinRoom& wanted = message.join();
  const auto source = seats.add_source(wanted.user_name());
  if (!source) return refuse_connection(connection, message.request(), wire::ERROR_ROOM_FULL, kRoomBusy);
  connection.name = wanted.user_name();
  connection.seats = &seats;
  connection.seat = *source;
  connection.state = ConnectionState::kActive;
  connection.joined = called_at;
  ++counters.joins;
  log("joined", connection.label() + " joined room " + seats.room().name() + " as a source of signals");
  wire::ServerControl answer = joined_source_answer(message.request(), seats.room().scene(), *source);
  give_credential(connection, wanted, *answer.mutable_joined());
  send(connection, answer);
}

/// Holds a join until the use of its token is on disk, without blocking the io thread. If the user got the seat before
/// the write, and the server were killed between the two, a second user could use the token.
void SessionHub::Impl::hold(Connection& connection, const wire::ClientControl& message) {
  connection.held_join = message;
  admission->use(connection.ticket);
  settle(connection);
}

/// Continues a held join after the write. All conditions are checked again, because another user may have taken the
/// last seat.
void SessionHub::Impl::settle(Connection& connection) {
  const InvitationLedger::Use use = admission->use_of(connection.ticket);
  if (use == InvitationLedger::Use::kBeingWritten) return;
  const wire::ClientControl granted = *std::exchange(connection.held_join, std::nullopt);
  if (use == InvitationLedger::Use::kNone) {
    const Refusal refusal = admission->unwritten();
    return refuse_connection(connection, granted.request(), refusal.code, refusal.text);
  }
  join_as_granted(connection, granted);
  if (connection.state != ConnectionState::kActive) admission->release(connection.ticket);
}

void SessionHub::Impl::assign_seat(Connection& connection, const wire::ClientControl& message, RoomSeats& seats) {
  const wire::JoinRoom& wanted = message.join();
  auto secret = transport.exported(connection.handle, secure::kDatagramExport, proto::seal_context(connection.id));
  // If tokens are required, every datagram must be sealed.
  if (admission && !secret) return end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "no keys for datagrams");
  const UserRole role = *role_of(wanted.role());
  std::vector<std::string> taken;
  for (const SessionUser* other : users_of(seats.room())) taken.push_back(other->name);
  const std::string name = name_beside(wanted.user_name(), taken);
  const auto seat = seats.allocate(role, wanted.deadband() > 0, proto::read_bounds(wanted.coupling_bounds()), name,
                                   connection.ticket.tool);
  if (!seat) return refuse_connection(connection, message.request(), wire::ERROR_ROOM_FULL, kRoomBusy);
  connection.name = name;
  connection.seats = &seats;
  connection.seat = *seat;
  connection.stream.emplace(seats, *seat,
                            proto::DatagramChannel::Settings{.sends = proto::DatagramType::kServerUpdate,
                                                             .connection = connection.id,
                                                             .epoch = connection.epoch,
                                                             .deadband = wanted.deadband(),
                                                             .max_rate_hz = 1 / to_seconds(seats.room().period()),
                                                             .is_stream = connection.state_over_tcp,
                                                             .secret = std::move(secret)},
                            connection.counters);
  connection.state = ConnectionState::kActive;
  connection.joined = called_at;
  ++counters.joins;
  log("joined", connection.label() + " joined room " + seats.room().name() + " as " +
                    (has_tool(role) ? (role == UserRole::kOperator ? "operator" : "manipulator") +
                                          (", tool " + std::to_string(seat->tool))
                                    : std::string("observer")));
  wire::ServerControl answer = joined_answer(message.request(), seats, *seat);
  give_credential(connection, wanted, *answer.mutable_joined());
  send(connection, answer);
  introduce(connection, wanted);
}

void SessionHub::Impl::give_credential(Connection& connection, const wire::JoinRoom& granted, wire::Joined& joined) {
  if (!admission) return;
  wire::JoinRoom here = granted;
  here.set_room(connection.room().name());
  const auto tool = has_tool(connection.seat.role) ? std::optional(connection.seat.tool) : std::nullopt;
  connection.credential = admission->note_joined(connection.ticket, here, tool, called_at);
  if (!connection.credential) return;
  joined.set_resume_credential(connection.credential->data(), connection.credential->size());
  joined.set_resume_within_s(static_cast<std::uint32_t>(kResumeWithin / std::chrono::seconds(1)));
}

void SessionHub::Impl::introduce(Connection& newcomer, const wire::JoinRoom& granted) {
  for (const SessionUser* other : users_of(newcomer.room())) {
    if (other != &newcomer) send(newcomer, user_joined(other->seat, other->name));
  }
  for (const auto& service : services) {
    if (newcomer.state == ConnectionState::kActive) service->on_joined(newcomer, granted);
  }
  if (newcomer.state != ConnectionState::kActive) return;
  announce_presence(newcomer, user_joined(newcomer.seat, newcomer.name));
}

/// Notifies the other users that `requester` has joined or left. If the join has not been sent to another user by the
/// time of the leave, that user gets neither of the two notifications.
void SessionHub::Impl::announce_presence(const Connection& requester, const wire::ServerControl& message) {
  const auto is_join = [&requester](const wire::ServerControl& unsent) {
    return unsent.has_user_joined() && unsent.user_joined().user() == requester.seat.user.value;
  };
  for (const auto& [handle, user] : connections) {
    if (user.get() == &requester || !user->is_in(requester.room())) continue;
    if (!message.has_user_left() || std::erase_if(user->presence, is_join) == 0) user->presence.push_back(message);
    send_news(*user);
  }
}

/// Revokes the user's credential and ends the user's other device. This happens when the user has left with the first
/// device, or was kicked with either device.
void SessionHub::Impl::end_other_device(const Admission::Id& credential, wire::DisconnectReason reason) {
  const Admission::Id first = reason == wire::DISCONNECT_KICKED ? admission->first_of(credential) : credential;
  const std::optional<Admission::Id> second = admission->revoke(first);
  const std::optional<Admission::Id> revoked = first == credential ? second : first;
  if (!revoked) return;
  for (const auto& [handle, other] : connections) {
    const bool is_it = other->credential == revoked && other->state == ConnectionState::kActive;
    if (is_it) end(*other, reason, "the user's other device left");
  }
}

void SessionHub::Impl::publish_admission() {
  if (!admission || !owner.on_admission || admission->changes() == published_admission) return;
  published_admission = admission->changes();
  owner.on_admission(admission->state(called_at));
}

}  // namespace tandem::server
