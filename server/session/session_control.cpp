#include <algorithm>
#include <utility>

#include "server/room/wire_role.hpp"
#include "server/session/session_hub_impl.hpp"
#include "server/session/user_name.hpp"

namespace tandem::server {
namespace {

/// Returns the first bound out of range; null: all present bounds are in range.
const proto::CouplingField* find_bad_bound(const wire::Coupling& bounds) {
  for (const proto::CouplingField& field : proto::kCouplingFields) {
    if ((bounds.*field.has)() && !field.accepts((bounds.*field.get)())) return &field;
  }
  return nullptr;
}

std::string whole(double number) {
  return std::to_string(static_cast<int>(number));
}

constexpr std::size_t kMaxProgramBytes = 200;
constexpr int kMaxCapabilities = 32;

}  // namespace

void SessionHub::Impl::receive_control_bytes(Connection& connection, std::span<const std::byte> bytes, LocalTime now) {
  if (!connection.reader.feed(bytes)) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "a control message was too long");
    return;
  }
  serve(connection, now);
}

/// Serves waiting messages of a connection within its turn; the rest stays in the reader.
void SessionHub::Impl::serve(Connection& connection, LocalTime now) {
  wire::ClientControl message;
  while (connection.state != ConnectionState::kClosed && !connection.held_join && connection.reader.has_next() &&
         has_turn(connection, now)) {
    if (!proto::parse_control(*connection.reader.next(), message)) {
      end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "a control message could not be read");
      return;
    }
    connection.last_received = now;
    if (!can_afford(connection, message, now)) {
      end(connection, wire::DISCONNECT_PROTOCOL_ERROR,
          "too many control messages: at most " + whole(kControlRate.per_second) + " a second, and " +
              whole(kControlRate.at_once) + " at once");
      return;
    }
    handle(connection, message, now);
  }
}

/// Serves waiting connections in turn, beginning after the one served last.
void SessionHub::Impl::serve_waiting(LocalTime now) {
  const auto serve_range = [this, now](auto from, auto to) {
    for (; from != to && turn.has_some(now); ++from) {
      if (!from->second->reader.has_next()) continue;
      served_last = from->first;
      serve(*from->second, now);
    }
  };
  const auto next = connections.upper_bound(served_last);
  serve_range(next, connections.end());
  serve_range(connections.begin(), next);
}

/// A joined user is not held up by the use of others at the same address.
bool SessionHub::Impl::has_turn(const Connection& connection, LocalTime now) const {
  if (!turn.has_some(now) || !connection.turn.has_some(now)) return false;
  return !connection.is_half_open() || connection.address->control.has_some(now);
}

/// Charges a message to the token buckets. Clients over the rate of an interactive program delay the states of all.
bool SessionHub::Impl::can_afford(Connection& connection, const wire::ClientControl& message, LocalTime now) {
  const bool has_own_pace = message.has_state_datagram() || message.has_get_asset();
  const double price = has_own_pace ? kOwnPace : 1.0;
  const double work = message.has_get_asset() || message.has_join() ? kBigAnswer : 1.0;
  turn.consume(work, now);
  connection.turn.consume(work, now);
  // A joined user's own-pace messages cost only the connection, so that they delay no newcomer of the address.
  if (connection.is_half_open() || !has_own_pace) {
    connection.address->control.consume(message.has_join() ? kJoinPrice : price, now);
  }
  return connection.control.consume(price, now);
}

void SessionHub::Impl::handle(Connection& connection, const wire::ClientControl& message, LocalTime now) {
  if (message.has_hello() && connection.state == ConnectionState::kGreeting) {
    greet(connection, message);
  } else if (message.has_join() && connection.state == ConnectionState::kJoining) {
    join(connection, message);
  } else if (!handle_in_any_state(connection, message) && !handle_active(connection, message, now)) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR,
        "that control message is not allowed in state " + std::string(name_of(connection.state)));
  }
}

bool SessionHub::Impl::handle_in_any_state(Connection& connection, const wire::ClientControl& message) {
  if (message.has_leave()) {
    if (message.leave().to_return() && connection.credential) {
      admission->note_lost(*std::exchange(connection.credential, std::nullopt), called_at);
    }
    end(connection, wire::DISCONNECT_LEFT, "left on request", message.request());
    return true;
  }
  if (message.has_ping() && connection.state != ConnectionState::kGreeting) {
    wire::ServerControl answer;
    answer.set_request(message.request());
    answer.mutable_pong()->set_token(message.ping().token());
    send(connection, answer);
    return true;
  }
  return false;
}

bool SessionHub::Impl::handle_active(Connection& connection, const wire::ClientControl& message, LocalTime now) {
  if (connection.state != ConnectionState::kActive) return false;
  switch (message.message_case()) {
    case wire::ClientControl::kGrab:
    case wire::ClientControl::kRelease:
      grab_or_release(connection, message);
      return true;
    case wire::ClientControl::kKick:
      kick(connection, message);
      return true;
    case wire::ClientControl::kSetParameter:
      set_parameter(connection, message);
      return true;
    case wire::ClientControl::kResetRoom:
      reset_room(connection, message);
      return true;
    case wire::ClientControl::kAskPose:
      ask_pose(connection, message);
      return true;
    case wire::ClientControl::kPoint:
      point(connection, message);
      return true;
    case wire::ClientControl::kGetAsset:
      send(connection, asset_answer(message.request(), message.get_asset(), connection.seats->room().scene()));
      return true;
    case wire::ClientControl::kStateDatagram:
      owner.on_datagram(std::as_bytes(std::span(message.state_datagram())), now,
                        [&connection](ConnectionHandle handle) { return handle == connection.handle; });
      return true;
    default:
      return false;
  }
}

void SessionHub::Impl::greet(Connection& connection, const wire::ClientControl& message) {
  const wire::Hello& hello = message.hello();
  if (hello.protocol_version() != proto::kProtocolVersion) {
    const std::string text = "this server speaks protocol version " + std::to_string(proto::kProtocolVersion) +
                             ", the client " + std::to_string(hello.protocol_version()) +
                             "; use programs of the same version";
    ++counters.refusals[wire::ERROR_WRONG_VERSION];
    send(connection, error_answer(message.request(), wire::ERROR_WRONG_VERSION, text));
    end(connection, wire::DISCONNECT_WRONG_VERSION, text);
    return;
  }
  if (hello.program().size() > kMaxProgramBytes || hello.capabilities_size() > kMaxCapabilities) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "hello is over its limits");
    return;
  }
  const auto can = [&hello](const char* capability) {
    return std::find(hello.capabilities().begin(), hello.capabilities().end(), capability) !=
           hello.capabilities().end();
  };
  connection.state_over_tcp = can(proto::kCapabilityStateTcp) && !can(proto::kCapabilityStateUdp);
  do {
    connection.id = ConnectionId{settings.connection_ids()};
  } while (!connection.id.is_valid() || active.contains(connection.id));
  active[connection.id] = &connection;
  connection.state = ConnectionState::kJoining;
  wire::ServerControl answer = welcome_answer(message.request(), settings);
  answer.mutable_welcome()->set_connection_id(connection.id.value);
  answer.mutable_welcome()->set_epoch(connection.epoch);
  for (const auto& seats : rooms) answer.mutable_welcome()->add_rooms(seats->room().name());
  send(connection, answer);
}

RoomSeats* SessionHub::Impl::find_room(const std::string& name) {
  if (name.empty() && rooms.size() == 1) return rooms.front().get();
  for (const auto& seats : rooms) {
    if (seats->room().name() == name) return seats.get();
  }
  return nullptr;
}

std::string SessionHub::Impl::room_names() const {
  std::string names;
  for (const auto& seats : rooms) names += (names.empty() ? "" : ", ") + seats->room().name();
  return names;
}

void SessionHub::Impl::join(Connection& connection, const wire::ClientControl& message) {
  wire::ClientControl granted = message;
  Admission::Ticket ticket;
  if (admit_user(connection, message.request(), *granted.mutable_join(), ticket)) {
    join_as_granted(connection, granted, ticket);
  }
}

/// Checks the join against admission, and limits `wanted` to the granted rights.
bool SessionHub::Impl::admit_user(Connection& connection, std::uint32_t request, wire::JoinRoom& wanted,
                                  Admission::Ticket& ticket) {
  if (!admission) return true;
  const auto exported =
      transport.exported(connection.handle, secure::kResumeExport, proto::seal_context(connection.id));
  if (const auto refusal = admission->admit(wanted, exported, called_at, ticket)) {
    refuse(connection, request, refusal->code, refusal->text);
    return false;
  }
  if (!ticket.is_resumed) return true;
  // The resumed user may still have a connection whose loss has not been detected yet.
  for (const auto& [handle, other] : connections) {
    if (other->credential != ticket.id || other->state != ConnectionState::kActive) continue;
    end(*other, wire::DISCONNECT_RESUMED, "the user rejoined on another connection");
  }
  return true;
}

void SessionHub::Impl::join_as_granted(Connection& connection, const wire::ClientControl& message,
                                       const Admission::Ticket& ticket) {
  const wire::JoinRoom& wanted = message.join();
  RoomSeats* seats = find_room(wanted.room());
  if (!is_acceptable_user_name(wanted.user_name())) {
    refuse(connection, message.request(), wire::ERROR_BAD_NAME,
           "a user name is 1 to 64 bytes of printable UTF-8, without invisible characters, its blanks single spaces; "
           "choose another");
  } else if (!role_of(wanted.role())) {
    refuse(connection, message.request(), wire::ERROR_BAD_VALUE, "the role must be manipulator, operator or observer");
  } else if (seats == nullptr) {
    refuse(connection, message.request(), wire::ERROR_UNKNOWN_ROOM,
           (wanted.room().empty() ? "several rooms are open, name one" : "there is no room " + quoted(wanted.room())) +
               "; rooms here: " + room_names());
  } else if (wanted.role() == wire::ROLE_OPERATOR && seats->has_operator()) {
    refuse(connection, message.request(), wire::ERROR_NOT_ALLOWED,
           "room " + seats->room().name() + " has an operator; join as a manipulator");
  } else if (!(wanted.deadband() >= 0 && wanted.deadband() <= net::kMaxDeadband)) {  // NaN, too, is refused
    refuse(connection, message.request(), wire::ERROR_BAD_VALUE, "the deadband must be 0 to 0.5");
  } else if (const proto::CouplingField* bad = find_bad_bound(wanted.coupling_bounds())) {
    refuse(connection, message.request(), wire::ERROR_BAD_VALUE,
           "coupling_bounds: " + std::string(bad->name) + " must be " + std::to_string(bad->low) + " to " +
               std::to_string(bad->high) + ", or absent");
  } else if (!seats->has_place(*role_of(wanted.role()))) {
    refuse(connection, message.request(), wire::ERROR_ROOM_FULL,
           "room " + seats->room().name() + " is full: no free place for " +
               (has_tool(*role_of(wanted.role())) ? "a manipulator; join as an observer, or wait" : "an observer"));
  } else if (admission && ticket.uses_token() && admission->use_of(ticket) != InvitationLedger::Use::kWritten) {
    hold(connection, message, ticket);
  } else {
    assign_seat(connection, message, *seats, ticket);
  }
}

/// Writes the token's use before giving a seat: a kill in between would leave it valid. Does not block io.
void SessionHub::Impl::hold(Connection& connection, const wire::ClientControl& message,
                            const Admission::Ticket& ticket) {
  connection.held_join = std::make_unique<HeldJoin>(HeldJoin{message, ticket});
  admission->use(ticket);
  settle(connection);
}

/// Continues a held join after its write. Checks everything again, because others may have taken the last place.
void SessionHub::Impl::settle(Connection& connection) {
  const InvitationLedger::Use use = admission->use_of(connection.held_join->ticket);
  if (use == InvitationLedger::Use::kBeingWritten) return;
  const auto held = std::move(connection.held_join);
  if (use == InvitationLedger::Use::kNone) {
    const Refusal refusal = admission->unwritten();
    return refuse(connection, held->granted.request(), refusal.code, refusal.text);
  }
  join_as_granted(connection, held->granted, held->ticket);
  if (connection.state != ConnectionState::kActive) admission->release(held->ticket);
}

void SessionHub::Impl::assign_seat(Connection& connection, const wire::ClientControl& message, RoomSeats& seats,
                                   const Admission::Ticket& ticket) {
  const wire::JoinRoom& wanted = message.join();
  auto secret = transport.exported(connection.handle, secure::kDatagramExport, proto::seal_context(connection.id));
  // With tokens, no datagram is sent unsealed.
  if (admission && !secret) return end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "no keys for datagrams");
  const UserRole role = *role_of(wanted.role());
  std::vector<std::string> taken;
  for (const auto& [handle, other] : connections) {
    if (other->is_in(seats)) taken.push_back(other->user_name);
  }
  const std::string user_name = name_beside(wanted.user_name(), taken);
  const auto seat =
      seats.allocate(role, wanted.deadband() > 0, proto::read_bounds(wanted.coupling_bounds()), user_name, ticket.tool);
  if (!seat) return refuse(connection, message.request(), wire::ERROR_ROOM_FULL, kRoomBusy);
  connection.user_name = user_name;
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
  connection.wants_soft_shapes = wanted.wants_soft_shapes();
  connection.state = ConnectionState::kActive;
  connection.joined = called_at;
  ++counters.joins;
  log("joined", connection.label() + " joined room " + seats.room().name() + " as " +
                    (has_tool(role) ? (role == UserRole::kOperator ? "operator" : "manipulator") +
                                          (", tool " + std::to_string(seat->tool))
                                    : std::string("observer")));
  wire::ServerControl answer = joined_answer(message.request(), seats, *seat);
  give_credential(connection, wanted, ticket, *answer.mutable_joined());
  send(connection, answer);
  introduce(connection);
}

void SessionHub::Impl::give_credential(Connection& connection, const wire::JoinRoom& granted,
                                       const Admission::Ticket& ticket, wire::Joined& joined) {
  if (!admission) return;
  wire::JoinRoom here = granted;
  here.set_room(connection.seats->room().name());
  const auto tool = has_tool(connection.seat.role) ? std::optional(connection.seat.tool) : std::nullopt;
  connection.credential = admission->note_joined(ticket, here, tool, called_at);
  if (!connection.credential) return;
  joined.set_resume_credential(connection.credential->data(), connection.credential->size());
  joined.set_resume_within_s(static_cast<std::uint32_t>(kResumeWithin / std::chrono::seconds(1)));
}

void SessionHub::Impl::introduce(Connection& newcomer) {
  for (const auto& [handle, other] : connections) {
    const bool is_other = other.get() != &newcomer && other->is_in(*newcomer.seats);
    if (is_other) send(newcomer, user_joined(other->seat, other->user_name));
  }
  if (settings.poses != nullptr) {
    for (const wire::KeptPose& pose : settings.poses->kept(newcomer.seats->room())) send(newcomer, kept_pose(pose));
  }
  if (newcomer.state != ConnectionState::kActive) return;
  announce_presence(newcomer, user_joined(newcomer.seat, newcomer.user_name));
}

/// If a user leaves before others were notified of the join, they get neither message.
void SessionHub::Impl::announce_presence(const Connection& subject, const wire::ServerControl& message) {
  const auto is_join_of_subject = [&subject](const wire::ServerControl& pending) {
    return pending.has_user_joined() && pending.user_joined().user() == subject.seat.user.value;
  };
  for (const auto& [handle, user] : connections) {
    if (user.get() == &subject || !user->is_in(*subject.seats)) continue;
    if (!message.has_user_left() || std::erase_if(user->presence, is_join_of_subject) == 0)
      user->presence.push_back(message);
    send_news(*user);
  }
}

void SessionHub::Impl::grab_or_release(Connection& connection, const wire::ClientControl& message) {
  if (!has_tool(connection.seat.role)) {
    send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED, "an observer cannot grab"));
    return;
  }
  const bool was_posted =
      message.has_grab() ? connection.seats->grab(connection.seat, BodyId{message.grab().body()}, message.request())
                         : connection.seats->release(connection.seat, message.request());
  if (!was_posted) send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED, kRoomBusy));
}

/// Removes a user; a kicked user can join again only with a new token.
void SessionHub::Impl::kick(Connection& connection, const wire::ClientControl& message) {
  const auto found = std::ranges::find_if(connections, [&](const auto& entry) {
    return entry.second->is_in(*connection.seats) && entry.second->seat.user.value == message.kick().user();
  });
  if (connection.seat.role != UserRole::kOperator) {
    send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED, "only the room's operator may kick"));
  } else if (found == connections.end() || found->second.get() == &connection) {
    send(connection, error_answer(message.request(), wire::ERROR_BAD_VALUE, "no other user of that number is here"));
  } else {
    wire::ServerControl answer = user_left(found->second->seat, wire::DISCONNECT_KICKED);
    end(*found->second, wire::DISCONNECT_KICKED, "kicked by the room's operator");
    answer.set_request(message.request());
    send(connection, answer);
  }
}

void SessionHub::Impl::set_parameter(Connection& connection, const wire::ClientControl& message) {
  const wire::SetParameter& wanted = message.set_parameter();
  const bool is_law = wanted.name() == proto::kLawParameter;
  const proto::CouplingField* field = proto::find_coupling_field(wanted.name());
  haptics::CouplingParameters parameters = connection.seats->coupling().parameters;
  if (field != nullptr) parameters.*(field->value) = wanted.value();
  if (connection.seat.role != UserRole::kOperator) {
    send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED,
                                  "only the room's operator may set parameters; join with --role operator"));
  } else if (is_law) {
    set_law(connection, message);
  } else if (field == nullptr) {
    std::string names(proto::kLawParameter);
    for (const proto::CouplingField& known : proto::kCouplingFields) names += ", " + std::string(known.name);
    send(connection, error_answer(message.request(), wire::ERROR_UNKNOWN_PARAMETER, "settable parameters: " + names));
  } else if (!field->accepts(wanted.value())) {
    send(connection, error_answer(message.request(), wire::ERROR_BAD_VALUE,
                                  std::string(field->name) + " must be " + std::to_string(field->low) + " to " +
                                      std::to_string(field->high)));
  } else if (physics::is_chosen_by_law(connection.seats->coupling(), field->value)) {
    send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED,
                                  std::string(field->name) + " follows the moved mass: the law is adaptive"));
  } else {
    connection.seats->set_coupling(connection.seat, parameters);
    announce_parameter(connection, message.request(), *field);
  }
}

/// Sets the law. Allowed during contact: both ends fade it (haptics::LawFade).
void SessionHub::Impl::set_law(Connection& connection, const wire::ClientControl& message) {
  RoomSeats& seats = *connection.seats;
  const physics::SceneCoupling& of_scene = seats.room().scene().world.coupling;
  const std::string& name = message.set_parameter().text();
  const haptics::CouplingLawInfo* const law = name.empty() ? nullptr : haptics::find_coupling_law(name);
  if (law == nullptr) {
    return send(connection, error_answer(message.request(), wire::ERROR_BAD_VALUE,
                                         std::string(proto::kLawParameter) +
                                             " must be one of: " + haptics::listed_coupling_law_names()));
  }
  const std::string problem =
      haptics::law_change_problem(*haptics::find_coupling_law(of_scene.law), *law, of_scene.fit.has_value());
  if (!problem.empty()) return send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED, problem));
  wire::ServerControl answer = law_set(law->name);
  answer.set_request(message.request());
  send(connection, answer);
  if (law->name == seats.coupling().law) return;
  log("law", connection.label() + " set the law " + name + " in room " + seats.room().name());
  change_coupling(
      seats, [&] { seats.set_law(connection.seat, *law); }, &connection);
}

/// Runs a change of the coupling, and notifies each user of the changes that concern them.
/// In      but  user already notified of the new law
void SessionHub::Impl::change_coupling(RoomSeats& seats, const std::function<void()>& change, const Connection* but) {
  std::vector<std::pair<Connection*, haptics::CouplingParameters>> before;
  for (const auto& [handle, user] : connections) {
    if (user->is_in(seats)) before.emplace_back(user.get(), seats.coupling_in_force(user->seat));
  }
  const std::string_view law_before = seats.coupling().law;
  change();
  for (const auto& [user, coupling] : before) {
    if (!user->is_in(seats)) continue;
    if (user != but && law_before != seats.coupling().law) user->has_new_law = true;
    user->note_changes(coupling);
    send_news(*user);
  }
}

void SessionHub::Impl::reset_room(Connection& connection, const wire::ClientControl& message) {
  if (connection.seat.role != UserRole::kOperator) {
    send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED,
                                  "only the room's operator may reset it; join with --role operator"));
  } else if (!connection.seats->reset(connection.seat, called_at)) {
    send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED, kRoomBusy));
  } else {
    if (settings.poses != nullptr)
      settings.poses->cancel(connection.seats->room(), std::nullopt, "the operator has reset the room");
    log("reset", connection.label() + " reset room " + connection.seats->room().name());
    for (const auto& [handle, user] : connections) {
      if (!user->is_in(*connection.seats)) continue;
      send(*user, room_reset(user.get() == &connection ? message.request() : 0, connection.seat.user));
    }
  }
}

/// Sends a changed coefficient to all users, each with the value for their own tool.
void SessionHub::Impl::announce_parameter(Connection& setter, std::uint32_t request,
                                          const proto::CouplingField& field) {
  const auto index = static_cast<std::size_t>(&field - proto::kCouplingFields.data());
  for (const auto& [handle, user] : connections) {
    if (!user->is_in(*setter.seats) || user.get() == &setter) continue;
    user->changed_parameters.set(index);
    send_news(*user);
  }
  wire::ServerControl answer = parameter_set(field, setter.seats->coupling_in_force(setter.seat));
  answer.set_request(request);
  send(setter, answer);
}

/// Sends merged news once the user has read the earlier bytes, so that many changes by others do not add up.
void SessionHub::Impl::send_news(Connection& connection) {
  const bool has_news = !connection.presence.empty() || connection.has_new_law || connection.changed_parameters.any();
  if (!has_news || transport.queued_control_bytes(connection.handle) > kMaxQueuedBeforeNews) return;
  for (const wire::ServerControl& message : std::exchange(connection.presence, {})) send(connection, message);
  if (std::exchange(connection.has_new_law, false)) send(connection, law_set(connection.seats->coupling().law));
  if (connection.changed_parameters.none()) return;
  const haptics::CouplingParameters in_force = connection.seats->coupling_in_force(connection.seat);
  for (std::size_t i = 0; i < proto::kCouplingFields.size(); ++i) {
    if (connection.changed_parameters.test(i)) send(connection, parameter_set(proto::kCouplingFields[i], in_force));
  }
  connection.changed_parameters.reset();
}

}  // namespace tandem::server
