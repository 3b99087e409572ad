#include "server/session/session_hub.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/base/units.hpp"
#include "proto/placement.hpp"
#include "server/session/session_hub_impl.hpp"
#include "server/session/user_name.hpp"

namespace tandem::server {

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

SessionHub::Impl::Impl(SessionHub& hub, HubSettings hub_settings, const std::vector<Room*>& hub_rooms,
                       ServerTransport& hub_transport)
    : owner(hub), settings(std::move(hub_settings)), transport(hub_transport), updates(hub_rooms.size()) {
  if (!settings.connection_ids) throw std::invalid_argument("HubSettings.connection_ids is empty; give it a source");
  if (settings.admission) admission.emplace(*settings.admission);
  for (Room* room : hub_rooms) {
    if (joined_answer_bound(room->scene()) > proto::kMaxControlBytes) {
      throw std::invalid_argument("room " + room->name() + ": the scene's description is over " +
                                  std::to_string(proto::kMaxControlBytes) + " bytes; use fewer shapes, or meshes");
    }
    rooms.push_back(std::make_unique<RoomSeats>(*room));
  }
}

/// Ends the oldest connection that has not joined, of the address with most of them. Joined users keep their places.
void SessionHub::Impl::make_room(Connection& newcomer) {
  const bool is_full = connections.size() > settings.max_connections;
  if (!is_full && half_open_of(*newcomer.address) <= kMaxHalfOpen) return;
  const AddressUse& crowded = is_full ? most_half_open(newcomer) : *newcomer.address;
  if (Connection* oldest = oldest_half_open(crowded, newcomer)) {
    end(*oldest, wire::DISCONNECT_REFUSED, "did not join, and newer connections need the place");
  } else if (is_full) {
    refuse(newcomer, 0, wire::ERROR_SERVER_FULL,
           "the server has its " + std::to_string(settings.max_connections) + " connections; try later");
  }
}

std::size_t SessionHub::Impl::half_open_of(const AddressUse& address) const {
  return static_cast<std::size_t>(std::ranges::count_if(connections, [&address](const auto& entry) {
    return entry.second->address == &address && entry.second->is_half_open();
  }));
}

Connection* SessionHub::Impl::oldest_half_open(const AddressUse& address, const Connection& but) {
  for (const auto& [handle, connection] : connections) {  // in order of arrival
    const bool is_candidate = connection.get() != &but && connection->is_half_open();
    if (is_candidate && connection->address == &address) return connection.get();
  }
  return nullptr;
}

/// Finds the address with most half-open connections, without the newcomer `but`. Among equals the oldest connection
/// decides.
AddressUse& SessionHub::Impl::most_half_open(const Connection& but) {
  AddressUse* most = but.address;
  std::size_t count = 0;
  for (const auto& [handle, connection] : connections) {  // in order of arrival
    if (connection.get() == &but || !connection->is_half_open()) continue;
    const std::size_t candidates = half_open_of(*connection->address) - (connection->address == but.address ? 1 : 0);
    if (candidates <= count) continue;
    most = connection->address;
    count = candidates;
  }
  return *most;
}

proto::DropReason SessionHub::Impl::receive_datagram(std::span<const std::byte> datagram, LocalTime now,
                                                     const std::function<bool(ConnectionHandle)>& may_belong_to,
                                                     AcceptedDatagram& accepted) {
  proto::DatagramHeader header;
  if (const proto::DropReason reason = proto::read_header(datagram, proto::DatagramType::kClientUpdate, header);
      reason != proto::DropReason::kNone) {
    return reason;
  }
  const auto found = active.find(header.connection);
  if (found == active.end()) return proto::DropReason::kUnknownConnection;
  Connection& connection = *found->second;
  if (connection.state != ConnectionState::kActive || !connection.stream->is_for(header)) {
    return proto::DropReason::kUnknownConnection;
  }
  if (may_belong_to && !may_belong_to(connection.handle)) return proto::DropReason::kNotAllowed;
  const bool is_state = header.type == proto::DatagramType::kClientUpdate;
  std::uint64_t path_answer = 0;
  const proto::DropReason reason = is_state ? connection.stream->receive(header, datagram, now)
                                            : connection.stream->receive_path(header, datagram, path_answer);
  collect(connection);
  if (reason != proto::DropReason::kNone) return reason;
  connection.last_received = now;
  if (!connection.updates.consume(1, now)) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR,
        "too many client updates: at most " + std::to_string(static_cast<int>(kUpdateRate.per_second)) + " a second");
    return proto::DropReason::kNotAllowed;
  }
  accepted.connection = connection.handle;
  const auto round_trip = is_state ? connection.stream->round_trip() : std::nullopt;
  if (round_trip && *round_trip >= Duration{0}) counters.round_trip.record(*round_trip);
  if (!is_state) accepted.path_answer = path_answer;
  if (connection.stream->has_hand()) note_start(connection, &RoomStart::add);
  return proto::DropReason::kNone;
}

/// Updates the common start after a hand has arrived or a user has left.
void SessionHub::Impl::note_start(const Connection& connection, bool (RoomStart::*change)(UserId, ServerTime)) {
  RoomSeats& seats = *connection.seats;
  if (!(seats.start().*change)(connection.seat.user, server_time_of_own_clock(called_at))) return;
  const wire::ServerControl message = room_start(seats.start());
  const std::uint32_t awaited = message.room_start().awaited();
  const auto countdown_ms = seats.room().start_settings().countdown / std::chrono::milliseconds(1);
  log("start", "room " + seats.room().name() +
                   (awaited > 0 ? " waits for " + counted(awaited, "more user", "more users")
                                : " begins in " + std::to_string(countdown_ms) + " ms"));
  broadcast(seats, message);
}

void SessionHub::Impl::deliver_events(RoomSeats& seats) {
  seats.flush();
  RoomEvent event;
  while (seats.room().next_event(event)) {
    if (event.kind == RoomEvent::Kind::kReturned) {
      broadcast(seats, body_returned(event.body));
      continue;
    }
    for (const auto& [handle, connection] : connections) {
      if (connection->is_in(seats) && connection->seat.user == event.user) send(*connection, grab_answer(event));
    }
  }
}

void Connection::note_changes(const haptics::CouplingParameters& before) {
  const haptics::CouplingParameters now = seats->coupling_in_force(seat);
  for (std::size_t i = 0; i < proto::kCouplingFields.size(); ++i) {
    const auto value = proto::kCouplingFields[i].value;
    if (before.*value != now.*value) changed_parameters.set(i);
  }
}

/// Sends the pointed place to all in the room; they see it, and their hands feel it.
void SessionHub::Impl::point(Connection& connection, const wire::ClientControl& message) {
  const wire::Point& point = message.point();
  const auto refuse_with = [&](auto code, auto text) { send(connection, error_answer(message.request(), code, text)); };
  if (!connection.seat.is_manipulator()) {
    refuse_with(wire::ERROR_NOT_ALLOWED, "observers do not point; join as a manipulator");
  } else if (!proto::is_place(point.place()) || !proto::is_place(point.place_w())) {
    refuse_with(wire::ERROR_BAD_VALUE, "a place is three numbers in metres, -1000 to 1000");
  } else if (point.body() > connection.seats->room().scene().world.bodies.size()) {
    refuse_with(wire::ERROR_UNKNOWN_BODY, "no body has that number here");
  } else if (!connection.points.consume(1, called_at)) {
    refuse_with(wire::ERROR_NOT_ALLOWED, "you point too often: one place a second, two at once; try again later");
  } else if (!connection.seats->may_point(called_at)) {
    refuse_with(wire::ERROR_NOT_ALLOWED, kRoomBusy);
  } else {
    wire::ServerControl announcement;
    announcement.mutable_pointed()->set_user(connection.seat.user.value);
    *announcement.mutable_pointed()->mutable_point() = point;
    send_to_room(connection.seats->room(), connection.seat.user, message.request(), announcement);
  }
}

/// Sends a message to all in a room; the request's number goes only to the user who made the request.
void SessionHub::Impl::send_to_room(const Room& room, UserId asker, std::uint32_t request,
                                    wire::ServerControl message) {
  for (const auto& [handle, connection] : connections) {
    if (connection->state != ConnectionState::kActive || &connection->seats->room() != &room) continue;
    message.set_request(connection->seat.user == asker ? request : 0);
    send(*connection, message);
  }
}

/// Sends the soft bodies' shapes to the users who requested them.
void SessionHub::Impl::send_soft_shapes(RoomSeats& seats) {
  if (!seats.room().soft_offsets().poll()) return;
  const SoftOffsets& offsets = seats.room().soft_offsets().front();
  for (std::size_t body = 0; body < offsets.size(); ++body) {
    const wire::ServerControl message = soft_shape(body, offsets[body]);
    for (const auto& [handle, connection] : connections) {
      if (connection->is_in(seats) && connection->wants_soft_shapes) send_soft_shape(*connection, message);
    }
  }
}

/// Shapes never queue: a shape is skipped while any byte is queued, or if it is unchanged.
void SessionHub::Impl::send_soft_shape(Connection& connection, const wire::ServerControl& message) {
  std::string& last_sent = connection.sent_soft_shapes[message.soft_shape().soft_body()];
  if (last_sent == message.soft_shape().offsets() || transport.queued_control_bytes(connection.handle) > 0) return;
  last_sent = message.soft_shape().offsets();
  send(connection, message);
}

/// Applies a room update; news about the coupling are sent after all states.
void SessionHub::Impl::apply_room_update(Connection& connection, const RoomUpdate& update) {
  RoomSeats& seats = *connection.seats;
  const Seat seat = connection.seat;
  const haptics::CouplingParameters before = seats.coupling_in_force(seat);
  seats.on_update(seat, update);
  connection.note_changes(before);
}

void SessionHub::Impl::end_overdue(Connection& connection, LocalTime now) {
  if (connection.state == ConnectionState::kActive) {
    if (now - connection.last_received < settings.silence_timeout) return;
    end(connection, wire::DISCONNECT_SILENCE,
        "nothing heard for " + std::to_string(settings.silence_timeout / std::chrono::milliseconds(1)) + " ms");
    return;
  }
  const bool has_greeted = connection.state == ConnectionState::kJoining;
  const Duration allowed = has_greeted ? settings.join_timeout : settings.hello_timeout;
  if (now - connection.connected < allowed) return;
  const char* const what = connection.held_join ? "the use of the token could not be written to the server's disk"
                           : has_greeted        ? "did not join"
                                                : "sent no hello";
  end(connection, wire::DISCONNECT_SILENCE,
      std::string(what) + " within " + std::to_string(allowed / std::chrono::milliseconds(1)) + " ms");
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

void SessionHub::Impl::broadcast(const RoomSeats& seats, const wire::ServerControl& message) {
  for (const auto& [handle, connection] : connections) {
    if (connection->is_in(seats)) send(*connection, message);
  }
}

void SessionHub::Impl::refuse(Connection& connection, std::uint32_t request, wire::ErrorCode code,
                              const std::string& text) {
  ++counters.refusals[static_cast<std::size_t>(code)];
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
  if (const auto held = std::move(connection.held_join)) admission->release(held->ticket);
  ++counters.ends[static_cast<std::size_t>(reason)];
  active.erase(connection.id);
  if (!was_active) {
    log("closed", connection.label() + " closed: " + text);
    return;
  }
  // Separate kinds, because the log limits the lines of each: short stays must not use up those of others.
  const std::string_view kind = called_at - connection.joined < kShortStay ? "left soon" : "left";
  log(kind, connection.label() + " left room " + connection.seats->room().name() + ": " + text + "; " +
                std::to_string(connection.stream->taken()) + " inputs taken");
  if (connection.credential && (reason == wire::DISCONNECT_LEFT || reason == wire::DISCONNECT_KICKED)) {
    end_other_device(*connection.credential, reason);
  } else if (connection.credential) {  // may run before the user's new connection has a seat, which it may not get
    admission->note_lost(*connection.credential, called_at);
  }
  if (settings.poses != nullptr) settings.poses->forget(connection.seats->room(), connection.seat.user);
  change_coupling(*connection.seats, [&connection] { connection.seats->leave(connection.seat); });
  note_start(connection, &RoomStart::remove);
  announce_presence(connection, user_left(connection.seat, reason));
}

/// Ends the user's other device too, if the user left with the first one or was kicked with either.
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

void SessionHub::Impl::sweep() {
  const auto erased = std::erase_if(connections, [](const auto& entry) {
    const bool is_closed = entry.second->state == ConnectionState::kClosed;
    if (is_closed) --entry.second->address->connections;
    return is_closed;
  });
  // An address is kept until its token bucket is full again, so reconnecting gives no new budget.
  if (erased == 0 && addresses.size() <= connections.size()) return;
  std::erase_if(addresses, [this](auto& entry) {
    return entry.second.connections == 0 && entry.second.control.is_full(called_at);
  });
}

void SessionHub::Impl::report_admission() {
  if (!admission || !owner.on_admission || admission->changes() == reported_admission) return;
  reported_admission = admission->changes();
  owner.on_admission(admission->state(called_at));
}

Connection* SessionHub::Impl::find(ConnectionHandle handle) {
  const auto found = connections.find(handle);
  const bool is_open = found != connections.end() && found->second->state != ConnectionState::kClosed;
  return is_open ? found->second.get() : nullptr;
}

SessionHub::SessionHub(HubSettings settings, const std::vector<Room*>& rooms, ServerTransport& transport)
    : impl_(std::make_unique<Impl>(*this, std::move(settings), rooms, transport)) {}

SessionHub::~SessionHub() = default;

void SessionHub::on_connected(ConnectionHandle connection, LocalTime now, const std::string& address) {
  impl_->called_at = now;
  auto& entry = impl_->connections[connection];
  entry = std::make_unique<Connection>();
  entry->handle = connection;
  entry->connected = entry->last_received = now;
  entry->address = &impl_->addresses[address];
  ++entry->address->connections;
  impl_->make_room(*entry);
  impl_->sweep();
}

void SessionHub::on_control_bytes(ConnectionHandle connection, std::span<const std::byte> bytes, LocalTime now) {
  impl_->called_at = now;
  if (Connection* found = impl_->find(connection)) impl_->receive_control_bytes(*found, bytes, now);
  impl_->sweep();
}

void SessionHub::on_disconnected(ConnectionHandle connection, LocalTime now, const std::string& why) {
  impl_->called_at = now;
  if (Connection* found = impl_->find(connection)) {
    impl_->forget(*found, wire::DISCONNECT_CONNECTION_LOST, why);
  }
  impl_->sweep();
}

AcceptedDatagram SessionHub::on_datagram(std::span<const std::byte> datagram, LocalTime now,
                                         const std::function<bool(ConnectionHandle)>& may_belong_to) {
  impl_->called_at = now;
  AcceptedDatagram accepted;
  impl_->counters.count_received(impl_->receive_datagram(datagram, now, may_belong_to, accepted));
  return accepted;
}

std::span<const std::byte> SessionHub::path_challenge(ConnectionHandle connection, std::uint64_t number,
                                                      LocalTime now) {
  Connection* const found = impl_->find(connection);
  if (found == nullptr || found->state != ConnectionState::kActive) return {};
  return found->stream->path_challenge(number, now);
}

void SessionHub::poll(const Clock& clock) {
  const LocalTime now = clock.now();
  impl_->called_at = now;
  for (std::size_t room = 0; room < impl_->rooms.size(); ++room) impl_->send_updates(room, clock);
  for (const auto& seats : impl_->rooms) {
    impl_->deliver_events(*seats);
    impl_->send_soft_shapes(*seats);
  }
  impl_->send_pose_answers();
  if (impl_->admission) impl_->admission->poll(now);
  for (const auto& [handle, connection] : impl_->connections) {
    if (connection->held_join) impl_->settle(*connection);
    if (connection->state == ConnectionState::kActive) impl_->send_news(*connection);
    if (connection->state != ConnectionState::kClosed) impl_->end_overdue(*connection, now);
  }
  impl_->serve_waiting(now);
  impl_->sweep();
  impl_->report_admission();
}

void SessionHub::begin_stop() {
  if (impl_->settings.poses != nullptr) impl_->settings.poses->begin_stop();
}

bool SessionHub::owes_answers() const {
  return impl_->settings.poses != nullptr && impl_->settings.poses->unanswered() > 0;
}

void SessionHub::stop(LocalTime now) {
  impl_->called_at = now;
  impl_->refuse_unanswered_poses();
  for (const auto& [handle, connection] : impl_->connections) {
    impl_->end(*connection, wire::DISCONNECT_SERVER_STOPPING, "the server is stopping");
  }
  impl_->sweep();
  impl_->report_admission();
}

bool SessionHub::is_behind(ConnectionHandle connection) const {
  const Connection* found = impl_->find(connection);
  return found != nullptr && found->reader.has_next();
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

std::array<std::size_t, 3> SessionHub::users_in(std::size_t room) const {
  std::array<std::size_t, 3> users{};
  const RoomSeats& seats = *impl_->rooms[room];
  for (const auto& [handle, connection] : impl_->connections) {
    if (connection->is_in(seats)) ++users[static_cast<std::size_t>(connection->seat.role)];
  }
  return users;
}

const HubCounters& SessionHub::counters() const {
  return impl_->counters;
}

}  // namespace tandem::server
