#include "server/session/session_hub.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "common/net/deadband.hpp"
#include "common/net/send_rate.hpp"
#include "proto/control_framing.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/state_codec.hpp"
#include "server/session/session_answers.hpp"
#include "server/session/user_name.hpp"

namespace tandem::server {
namespace {

constexpr const char* kProgram = "tandem-server";
constexpr std::size_t kMaxProgramBytes = 200;
constexpr int kMaxCapabilities = 32;

struct Connection {
  ConnectionHandle handle = 0;
  ConnectionState state = ConnectionState::kGreeting;
  ConnectionId id;
  std::uint8_t epoch = 0;
  LocalTime connected{};
  LocalTime last_heard{};
  proto::FrameReader reader;
  bool state_over_tcp = false;

  // kActive
  std::string user_name;
  RoomSeats* seats = nullptr;
  Seat seat;

  // State in
  proto::FreshnessFilter freshness;
  bool has_input = false;
  LocalTime input_sent{};      // t1 of the newest accepted
  LocalTime input_received{};  // t2
  proto::ClientMode mode = proto::ClientMode::kHandle;
  // State out
  proto::ServerUpdateEncoder encoder;
  std::uint64_t sequence = 0;
  Step last_step;
  net::Deadband deadband{0};
  net::SendRate send_rate{net::kDeadbandFloor, 0};  // of the room, when it has joined
  TickFaults untold_faults = 0;                     // of steps that nothing was sent of
  LocalTime told_at{};
  proto::ServerUpdate told;  // sent last

  std::string label() const {
    if (seats == nullptr) return "connection " + std::to_string(handle);
    return "user " + std::to_string(seat.user.value) + " " + quoted(user_name);
  }
};

}  // namespace

std::string_view name_of(ConnectionState state) {
  switch (state) {
    case ConnectionState::kGreeting:
      return "greeting";
    case ConnectionState::kJoining:
      return "joining";
    case ConnectionState::kActive:
      return "active";
    case ConnectionState::kClosed:
      break;
  }
  return "closed";
}

// A connection that ends is only marked kClosed; sweep() erases it when the outermost call is done, so that
// loops over the connections may end any of them.
struct SessionHub::Impl {
  Impl(SessionHub& owner, HubSettings hub_settings, const std::vector<Room*>& hub_rooms,
       ServerTransport& hub_transport);

  void refuse_when_full(Connection& connection, LocalTime now);
  void take_control_bytes(Connection& connection, std::span<const std::byte> bytes, LocalTime now);
  void handle(Connection& connection, const wire::ClientControl& message, LocalTime now);
  bool handle_in_any_state(Connection& connection, const wire::ClientControl& message);
  bool handle_active(Connection& connection, const wire::ClientControl& message, LocalTime now);
  void greet(Connection& connection, const wire::ClientControl& message);
  void join(Connection& connection, const wire::ClientControl& message);
  void introduce(Connection& newcomer);
  RoomSeats* find_room(const std::string& name);
  void grab_or_release(Connection& connection, const wire::ClientControl& message);
  void set_parameter(Connection& connection, const wire::ClientControl& message);
  void tell_parameter(const Connection& setter, std::uint32_t request, const proto::CouplingField& field);

  proto::DropReason take_datagram(std::span<const std::byte> datagram, LocalTime now,
                                  const std::function<bool(ConnectionHandle)>& may_belong_to,
                                  ConnectionHandle& accepted);
  void give_to_room(Connection& connection, const proto::ClientUpdate& update, LocalTime now);
  void send_newest_update(Connection& connection, LocalTime now);
  bool must_be_told(const Connection& connection, const proto::ServerUpdate& published, LocalTime now) const;
  void send_state(Connection& connection);
  void deliver_events(RoomSeats& seats);
  void note(Connection& connection, const UserUpdate& told);
  void end_overdue(Connection& connection, LocalTime now);

  void send(Connection& connection, const wire::ServerControl& message);
  void send_unchecked(Connection& connection, const wire::ServerControl& message);
  void broadcast(const RoomSeats& seats, const wire::ServerControl& message, const Connection* except);
  void refuse(Connection& connection, std::uint32_t request, wire::ErrorCode code, const std::string& text);
  void end(Connection& connection, wire::DisconnectReason reason, const std::string& text, std::uint32_t request = 0);
  void forget(Connection& connection, wire::DisconnectReason reason, const std::string& text);
  void sweep();
  Connection* find(ConnectionHandle handle);
  void log(const std::string& line) const {
    if (owner.on_log) owner.on_log(line);
  }

  SessionHub& owner;
  HubSettings settings;
  ServerTransport& transport;
  std::vector<std::unique_ptr<RoomSeats>> rooms;
  std::map<ConnectionHandle, std::unique_ptr<Connection>> connections;
  std::unordered_map<ConnectionId, Connection*> active;
  HubCounters counters;
  proto::ServerUpdate update;  // scratch, too big for the stack of a deep call
  proto::Bytes datagram_out;
  proto::Bytes frame_out;
};

SessionHub::Impl::Impl(SessionHub& hub, HubSettings hub_settings, const std::vector<Room*>& hub_rooms,
                       ServerTransport& hub_transport)
    : owner(hub), settings(std::move(hub_settings)), transport(hub_transport) {
  if (!settings.connection_ids) throw std::invalid_argument("HubSettings.connection_ids is empty; give it a source");
  for (Room* room : hub_rooms) {
    if (joined_answer_bound(room->scene()) > proto::kMaxControlBytes) {
      throw std::invalid_argument("room " + room->name() + ": the scene's description is over " +
                                  std::to_string(proto::kMaxControlBytes) + " bytes; use fewer shapes, or meshes");
    }
    rooms.push_back(std::make_unique<RoomSeats>(*room));
  }
}

void SessionHub::Impl::refuse_when_full(Connection& connection, LocalTime now) {
  connection.connected = now;
  connection.last_heard = now;
  if (connections.size() <= settings.max_connections) return;
  refuse(connection, 0, wire::ERROR_SERVER_FULL,
         "the server has its " + std::to_string(settings.max_connections) + " connections; try later");
}

void SessionHub::Impl::take_control_bytes(Connection& connection, std::span<const std::byte> bytes, LocalTime now) {
  if (!connection.reader.feed(bytes)) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "a control message was too long");
    return;
  }
  wire::ClientControl message;
  while (connection.state != ConnectionState::kClosed) {
    const auto payload = connection.reader.next();
    if (!payload) return;
    if (!proto::parse_control(*payload, message)) {
      end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "a control message could not be read");
      return;
    }
    connection.last_heard = now;
    handle(connection, message, now);
  }
}

void SessionHub::Impl::handle(Connection& connection, const wire::ClientControl& message, LocalTime now) {
  using Case = wire::ClientControl;
  if (message.message_case() == Case::kHello && connection.state == ConnectionState::kGreeting) {
    greet(connection, message);
  } else if (message.message_case() == Case::kJoin && connection.state == ConnectionState::kJoining) {
    join(connection, message);
  } else if (!handle_in_any_state(connection, message) && !handle_active(connection, message, now)) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR,
        "that control message is not allowed in state " + std::string(name_of(connection.state)));
  }
}

bool SessionHub::Impl::handle_in_any_state(Connection& connection, const wire::ClientControl& message) {
  if (message.has_leave()) {
    end(connection, wire::DISCONNECT_LEFT, "asked to leave", message.request());
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
    case wire::ClientControl::kSetParameter:
      set_parameter(connection, message);
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
  wire::ServerControl answer;
  answer.set_request(message.request());
  wire::Welcome& welcome = *answer.mutable_welcome();
  welcome.set_protocol_version(proto::kProtocolVersion);
  welcome.set_program(kProgram);
  welcome.add_capabilities(proto::kCapabilityStateUdp);
  welcome.add_capabilities(proto::kCapabilityStateTcp);
  welcome.set_connection_id(connection.id.value);
  welcome.set_epoch(connection.epoch);
  welcome.set_datagram_port(settings.datagram_port);
  for (const auto& seats : rooms) welcome.add_rooms(seats->room().name());
  welcome.set_silence_timeout_ms(static_cast<std::uint32_t>(settings.silence_timeout / std::chrono::milliseconds(1)));
  send(connection, answer);
}

RoomSeats* SessionHub::Impl::find_room(const std::string& name) {
  if (name.empty() && rooms.size() == 1) return rooms.front().get();
  for (const auto& seats : rooms) {
    if (seats->room().name() == name) return seats.get();
  }
  return nullptr;
}

void SessionHub::Impl::join(Connection& connection, const wire::ClientControl& message) {
  const wire::JoinRoom& wanted = message.join();
  if (!is_acceptable_user_name(wanted.user_name())) {
    refuse(connection, message.request(), wire::ERROR_BAD_NAME,
           "a user name is 1 to 64 bytes of printable UTF-8; choose another");
    return;
  }
  if (wanted.role() != wire::ROLE_MANIPULATOR && wanted.role() != wire::ROLE_OBSERVER) {
    refuse(connection, message.request(), wire::ERROR_BAD_VALUE, "the role must be manipulator or observer");
    return;
  }
  RoomSeats* seats = find_room(wanted.room());
  if (seats == nullptr) {
    std::string names;
    for (const auto& room : rooms) names += (names.empty() ? "" : ", ") + room->room().name();
    refuse(connection, message.request(), wire::ERROR_UNKNOWN_ROOM,
           (wanted.room().empty() ? "several rooms are open, name one" : "there is no room " + quoted(wanted.room())) +
               "; rooms here: " + names);
    return;
  }
  // Every comparison with NaN is false.
  if (!(wanted.deadband() >= 0 && wanted.deadband() <= net::kMaxDeadband)) {
    refuse(connection, message.request(), wire::ERROR_BAD_VALUE, "the deadband must be 0 to 0.5");
    return;
  }
  const UserRole role = wanted.role() == wire::ROLE_MANIPULATOR ? UserRole::kManipulator : UserRole::kObserver;
  connection.deadband = net::Deadband(wanted.deadband());
  connection.send_rate = net::SendRate(net::kDeadbandFloor, 1 / to_seconds(seats->room().period()));
  const auto seat = seats->take(role, !connection.deadband.is_off());
  if (!seat) {
    refuse(connection, message.request(), wire::ERROR_ROOM_FULL,
           "room " + seats->room().name() + " is full: no free place for " +
               (role == UserRole::kManipulator ? "a manipulator; join as an observer, or wait" : "an observer"));
    return;
  }
  connection.user_name = wanted.user_name();
  connection.seats = seats;
  connection.seat = *seat;
  connection.state = ConnectionState::kActive;
  ++counters.joins;
  log(connection.label() + " joined room " + seats->room().name() + " as " +
      (role == UserRole::kManipulator ? "manipulator, tool " + std::to_string(seat->tool) : std::string("observer")));
  send(connection, joined_answer(message.request(), *seats, *seat));
  introduce(connection);
}

void SessionHub::Impl::introduce(Connection& newcomer) {
  for (const auto& [handle, other] : connections) {
    const bool is_member = other->state == ConnectionState::kActive && other->seats == newcomer.seats;
    if (is_member && other.get() != &newcomer) send(newcomer, user_joined(other->seat, other->user_name));
  }
  if (newcomer.state != ConnectionState::kActive) return;
  broadcast(*newcomer.seats, user_joined(newcomer.seat, newcomer.user_name), &newcomer);
}

void SessionHub::Impl::grab_or_release(Connection& connection, const wire::ClientControl& message) {
  if (connection.seat.role != UserRole::kManipulator) {
    send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED, "an observer cannot grab"));
    return;
  }
  const bool was_posted =
      message.has_grab() ? connection.seats->grab(connection.seat, BodyId{message.grab().body()}, message.request())
                         : connection.seats->release(connection.seat, message.request());
  if (!was_posted) send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED, kRoomBusy));
}

void SessionHub::Impl::set_parameter(Connection& connection, const wire::ClientControl& message) {
  const wire::SetParameter& wanted = message.set_parameter();
  const proto::CouplingField* field = proto::find_coupling_field(wanted.name());
  haptics::CouplingParameters parameters = connection.seats->coupling();
  if (field != nullptr) parameters.*(field->value) = wanted.value();
  if (connection.seat.role != UserRole::kManipulator) {
    send(connection, error_answer(message.request(), wire::ERROR_NOT_ALLOWED, "an observer cannot set parameters"));
  } else if (field == nullptr) {
    std::string names;
    for (const proto::CouplingField& known : proto::kCouplingFields)
      names += (names.empty() ? "" : ", ") + std::string(known.name);
    send(connection, error_answer(message.request(), wire::ERROR_UNKNOWN_PARAMETER, "settable parameters: " + names));
  } else if (!field->accepts(wanted.value())) {
    send(connection, error_answer(message.request(), wire::ERROR_BAD_VALUE,
                                  std::string(field->name) + " must be " + std::to_string(field->low) + " to " +
                                      std::to_string(field->high)));
  } else if (physics::is_chosen_by_law(connection.seats->room().scene().world.coupling, field->value)) {
    send(connection,
         error_answer(message.request(), wire::ERROR_NOT_ALLOWED,
                      std::string(field->name) + " follows what a tool moves: the scene's law is adaptive"));
  } else {
    connection.seats->set_coupling(connection.seat, parameters);
    tell_parameter(connection, message.request(), *field);
  }
}

/// Each the value for the own tool.
void SessionHub::Impl::tell_parameter(const Connection& setter, std::uint32_t request,
                                      const proto::CouplingField& field) {
  for (const auto& [handle, member] : connections) {
    if (member->state != ConnectionState::kActive || member->seats != setter.seats) continue;
    wire::ServerControl answer = parameter_set(field, setter.seats->coupling_in_force(member->seat));
    if (member.get() == &setter) answer.set_request(request);
    send(*member, answer);
  }
}

proto::DropReason SessionHub::Impl::take_datagram(std::span<const std::byte> datagram, LocalTime now,
                                                  const std::function<bool(ConnectionHandle)>& may_belong_to,
                                                  ConnectionHandle& accepted) {
  proto::DatagramHeader header;
  if (const proto::DropReason reason = proto::parse_header(datagram, header); reason != proto::DropReason::kNone)
    return reason;
  if (header.type != proto::DatagramType::kClientUpdate) return proto::DropReason::kType;
  const auto found = active.find(header.connection);
  if (found == active.end()) return proto::DropReason::kUnknownConnection;
  Connection& connection = *found->second;
  if (connection.state != ConnectionState::kActive || connection.epoch != header.epoch) {
    return proto::DropReason::kUnknownConnection;
  }
  if (may_belong_to && !may_belong_to(connection.handle)) return proto::DropReason::kNotAllowed;
  // The filter advances only for a datagram that passes everything: else one damaged sequence number would
  // shut out the good ones that follow.
  proto::FreshnessFilter advanced = connection.freshness;
  if (const proto::DropReason reason = advanced.accept(header.sequence); reason != proto::DropReason::kNone)
    return reason;
  proto::ClientUpdate input;
  if (const proto::DropReason reason = proto::parse_client_update(proto::payload_of(datagram), input);
      reason != proto::DropReason::kNone) {
    return reason;
  }
  if (connection.seat.role == UserRole::kObserver && input.handle_valid) return proto::DropReason::kNotAllowed;
  connection.freshness = advanced;
  give_to_room(connection, input, now);
  accepted = connection.handle;
  return proto::DropReason::kNone;
}

void SessionHub::Impl::give_to_room(Connection& connection, const proto::ClientUpdate& input, LocalTime now) {
  connection.last_heard = now;
  connection.has_input = true;
  connection.input_sent = input.sent;
  connection.input_received = now;
  connection.mode = input.mode;
  if (input.acknowledged_sent != ServerTime{}) {
    const Duration sent = input.acknowledged_sent.time_since_epoch();
    connection.send_rate.delivered(sent, input.sent.time_since_epoch() - input.acknowledged_held - sent);
  }
  // An observer's updates only say that it is there and where; they never reach the world.
  if (connection.seat.role != UserRole::kManipulator) return;
  if (connection.seats->room().mailboxes(connection.seat.index).input.publish(input)) {
    counters.received_drops.add(proto::DropReason::kOverwritten);
  }
}

void SessionHub::Impl::send_newest_update(Connection& connection, LocalTime now) {
  auto& output = connection.seats->room().mailboxes(connection.seat.index).output;
  if (!output.poll()) return;
  // What the seat's previous user was not sent any more.
  if (output.front().user != connection.seat.user) return;
  note(connection, output.front());
  if (connection.state != ConnectionState::kActive) return;
  const proto::ServerUpdate& published = output.front().update;
  if (connection.last_step.value != 0 && published.step.value > connection.last_step.value + 1) {
    counters.sent_drops.add(proto::DropReason::kOverwritten, published.step.value - connection.last_step.value - 1);
  }
  connection.last_step = published.step;
  connection.untold_faults |= published.tick_faults;
  // Until its first datagram nobody knows where a user's datagrams should go.
  if (!connection.has_input && !connection.state_over_tcp) return;
  if (!must_be_told(connection, published, now)) {
    ++counters.updates_held_back;
    return;
  }
  // A stream paces itself (send_state()).
  if (!connection.state_over_tcp && !connection.send_rate.may_send(now.time_since_epoch())) {
    ++counters.updates_paced;
    return;
  }
  connection.send_rate.sent(now.time_since_epoch());
  if (!connection.deadband.is_off()) {
    connection.told = published;
    connection.told_at = now;
  }
  update = published;
  update.tick_faults = std::exchange(connection.untold_faults, 0);
  update.echoed_sent = connection.input_sent;
  update.received = connection.has_input ? server_time_of_own_clock(connection.input_received) : ServerTime{};
  update.sent = server_time_of_own_clock(now);
  send_state(connection);
}

// A client without a local model of its own couples to the tool where it was last told to be; one with a model compares
// it with what was, at that input.
bool SessionHub::Impl::must_be_told(const Connection& connection, const proto::ServerUpdate& published,
                                    LocalTime now) const {
  const net::Deadband& deadband = connection.deadband;
  const proto::ServerUpdate& told = connection.told;
  if (deadband.is_off() || now - connection.told_at >= net::kDeadbandFloor) return true;
  if (connection.mode == proto::ClientMode::kWave || published.held_body != told.held_body) return true;
  if (published.tick_faults != told.tick_faults || published.users.size() != told.users.size()) return true;
  const haptics::CouplingParameters coupling = connection.seats->coupling_in_force(connection.seat);
  const bool has_model = connection.mode == proto::ClientMode::kLocalModel;
  return deadband.notices(published.wrench_on_hand_W, told.wrench_on_hand_W) ||
         deadband.notices(published.tool, told.tool, now - connection.told_at,
                          has_model ? net::BetweenStates::kExtrapolated : net::BetweenStates::kHeld,
                          published.wrench_on_hand_W, {coupling.stiffness_n_per_m, coupling.stiffness_n_m_per_rad});
}

void SessionHub::Impl::send_state(Connection& connection) {
  if (connection.state_over_tcp && transport.queued_control_bytes(connection.handle) > 0) {
    counters.sent_drops.add(proto::DropReason::kOverwritten);
    return;
  }
  datagram_out.clear();
  proto::append_header({proto::DatagramType::kServerUpdate, connection.epoch, connection.id, ++connection.sequence},
                       datagram_out);
  connection.encoder.append(update, datagram_out);
  counters.bodies_thinned += connection.encoder.thinned();
  if (connection.state_over_tcp) {
    wire::ServerControl message;
    message.set_state_datagram(datagram_out.data(), datagram_out.size());
    send(connection, message);
  } else if (!transport.send_datagram(connection.handle, datagram_out)) {
    counters.sent_drops.add(proto::DropReason::kSendFailed);
    return;
  }
  ++counters.datagrams_sent;
}

void SessionHub::Impl::deliver_events(RoomSeats& seats) {
  seats.flush();
  RoomEvent event;
  while (seats.room().next_event(event)) {
    for (const auto& [handle, connection] : connections) {
      if (connection->state != ConnectionState::kActive || connection->seats != &seats) continue;
      if (connection->seat.user == event.user) send(*connection, grab_answer(event));
    }
  }
}

/// With what it changes of the coupling.
void SessionHub::Impl::note(Connection& connection, const UserUpdate& told) {
  RoomSeats& seats = *connection.seats;
  const Seat seat = connection.seat;
  const haptics::CouplingParameters before = seats.coupling_in_force(seat);
  seats.on_update(seat, told);
  const haptics::CouplingParameters after = seats.coupling_in_force(seat);
  for (const proto::CouplingField& field : proto::kCouplingFields) {
    if (connection.state != ConnectionState::kActive) return;
    if (before.*field.value != after.*field.value) send(connection, parameter_set(field, after));
  }
}

void SessionHub::Impl::end_overdue(Connection& connection, LocalTime now) {
  if (connection.state == ConnectionState::kActive) {
    if (now - connection.last_heard < settings.silence_timeout) return;
    end(connection, wire::DISCONNECT_SILENCE,
        "nothing heard for " + std::to_string(settings.silence_timeout / std::chrono::milliseconds(1)) + " ms");
  } else if (now - connection.connected >= settings.hello_timeout) {
    end(connection, wire::DISCONNECT_SILENCE,
        "did not join within " + std::to_string(settings.hello_timeout / std::chrono::milliseconds(1)) + " ms");
  }
}

void SessionHub::Impl::send(Connection& connection, const wire::ServerControl& message) {
  if (connection.state == ConnectionState::kClosed) return;
  if (transport.queued_control_bytes(connection.handle) > kMaxQueuedControlBytes) {
    end(connection, wire::DISCONNECT_SLOW, "control messages piled up unread");
    return;
  }
  send_unchecked(connection, message);
}

void SessionHub::Impl::send_unchecked(Connection& connection, const wire::ServerControl& message) {
  frame_out.clear();
  proto::append_frame(message, frame_out);
  transport.send_control(connection.handle, frame_out);
}

void SessionHub::Impl::broadcast(const RoomSeats& seats, const wire::ServerControl& message, const Connection* except) {
  for (const auto& [handle, connection] : connections) {
    const bool is_member = connection->state == ConnectionState::kActive && connection->seats == &seats;
    if (is_member && connection.get() != except) send(*connection, message);
  }
}

void SessionHub::Impl::refuse(Connection& connection, std::uint32_t request, wire::ErrorCode code,
                              const std::string& text) {
  send(connection, error_answer(request, code, text));
  end(connection, wire::DISCONNECT_REFUSED, text);
}

void SessionHub::Impl::end(Connection& connection, wire::DisconnectReason reason, const std::string& text,
                           std::uint32_t request) {
  if (connection.state == ConnectionState::kClosed) return;
  forget(connection, reason, text);
  send_unchecked(connection, goodbye(request, reason, text));
  transport.close(connection.handle);
}

void SessionHub::Impl::forget(Connection& connection, wire::DisconnectReason reason, const std::string& text) {
  const bool was_active = connection.state == ConnectionState::kActive;
  connection.state = ConnectionState::kClosed;
  active.erase(connection.id);
  if (!was_active) {
    log(connection.label() + " closed: " + text);
    return;
  }
  log(connection.label() + " left room " + connection.seats->room().name() + ": " + text);
  connection.seats->leave(connection.seat);
  broadcast(*connection.seats, user_left(connection.seat, reason), &connection);
}

void SessionHub::Impl::sweep() {
  std::erase_if(connections, [](const auto& entry) { return entry.second->state == ConnectionState::kClosed; });
}

Connection* SessionHub::Impl::find(ConnectionHandle handle) {
  const auto found = connections.find(handle);
  return found == connections.end() ? nullptr : found->second.get();
}

SessionHub::SessionHub(HubSettings settings, std::vector<Room*> rooms, ServerTransport& transport)
    : impl_(std::make_unique<Impl>(*this, std::move(settings), rooms, transport)) {}

SessionHub::~SessionHub() = default;

void SessionHub::on_connected(ConnectionHandle connection, LocalTime now) {
  auto& entry = impl_->connections[connection];
  entry = std::make_unique<Connection>();
  entry->handle = connection;
  impl_->refuse_when_full(*entry, now);
  impl_->sweep();
}

void SessionHub::on_control_bytes(ConnectionHandle connection, std::span<const std::byte> bytes, LocalTime now) {
  if (Connection* found = impl_->find(connection)) impl_->take_control_bytes(*found, bytes, now);
  impl_->sweep();
}

void SessionHub::on_disconnected(ConnectionHandle connection, LocalTime) {
  if (Connection* found = impl_->find(connection)) {
    impl_->forget(*found, wire::DISCONNECT_CONNECTION_LOST, "the connection was lost");
  }
  impl_->sweep();
}

ConnectionHandle SessionHub::on_datagram(std::span<const std::byte> datagram, LocalTime now,
                                         const std::function<bool(ConnectionHandle)>& may_belong_to) {
  ConnectionHandle accepted = 0;
  ++impl_->counters.datagrams_received;
  const proto::DropReason reason = impl_->take_datagram(datagram, now, may_belong_to, accepted);
  if (reason != proto::DropReason::kNone) impl_->counters.received_drops.add(reason);
  return accepted;
}

void SessionHub::poll(LocalTime now) {
  for (const auto& seats : impl_->rooms) impl_->deliver_events(*seats);
  for (const auto& [handle, connection] : impl_->connections) {
    if (connection->state == ConnectionState::kActive) impl_->send_newest_update(*connection, now);
    if (connection->state != ConnectionState::kClosed) impl_->end_overdue(*connection, now);
  }
  impl_->sweep();
}

void SessionHub::stop(LocalTime) {
  for (const auto& [handle, connection] : impl_->connections) {
    impl_->end(*connection, wire::DISCONNECT_SERVER_STOPPING, "the server is stopping");
  }
  impl_->sweep();
}

ConnectionState SessionHub::state_of(ConnectionHandle connection) const {
  const Connection* found = impl_->find(connection);
  return found == nullptr ? ConnectionState::kClosed : found->state;
}

std::size_t SessionHub::connection_count() const {
  return impl_->connections.size();
}

std::size_t SessionHub::user_count() const {
  std::size_t count = 0;
  for (const auto& [handle, connection] : impl_->connections) count += connection->state == ConnectionState::kActive;
  return count;
}

const HubCounters& SessionHub::counters() const {
  return impl_->counters;
}

}  // namespace tandem::server
