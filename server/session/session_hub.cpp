#include "server/session/session_hub.hpp"

#include <stdexcept>

#include "server/session/session_hub_impl.hpp"

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

proto::DropReason SessionHub::Impl::take_datagram(std::span<const std::byte> datagram, LocalTime now,
                                                  const std::function<bool(ConnectionHandle)>& may_belong_to,
                                                  ConnectionHandle& accepted) {
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
  const proto::DropReason reason = connection.stream->receive(header, datagram, now);
  if (reason != proto::DropReason::kNone) return reason;
  connection.last_heard = now;
  accepted = connection.handle;
  return proto::DropReason::kNone;
}

void SessionHub::Impl::send_newest_update(Connection& connection, LocalTime now) {
  auto& output = connection.seats->room().output(connection.seat.index);
  if (!output.poll()) return;
  // What the seat's previous user was not sent any more.
  if (output.front().user != connection.seat.user) return;
  take_room_update(connection, output.front());
  if (connection.state != ConnectionState::kActive) return;
  const bool is_blocked = connection.state_over_tcp && transport.queued_control_bytes(connection.handle) > 0;
  counters.bodies_thinned +=
      connection.stream->send(output.front().update, is_blocked, now,
                              [&](std::span<const std::byte> datagram) { return deliver_state(connection, datagram); });
}

bool SessionHub::Impl::deliver_state(Connection& connection, std::span<const std::byte> datagram) {
  if (!connection.state_over_tcp) return transport.send_datagram(connection.handle, datagram);
  wire::ServerControl message;
  message.set_state_datagram(datagram.data(), datagram.size());
  send(connection, message);
  return true;
}

void SessionHub::Impl::deliver_events(RoomSeats& seats) {
  seats.flush();
  RoomEvent event;
  while (seats.room().next_event(event)) {
    if (event.kind == RoomEvent::Kind::kPutBack) {
      broadcast(seats, body_returned(event.body), nullptr);
      continue;
    }
    for (const auto& [handle, connection] : connections) {
      if (connection->is_in(seats) && connection->seat.user == event.user) send(*connection, grab_answer(event));
    }
  }
}

/// Tells the user what it changes of the coupling.
void SessionHub::Impl::take_room_update(Connection& connection, const UserUpdate& update) {
  RoomSeats& seats = *connection.seats;
  const Seat seat = connection.seat;
  const haptics::CouplingParameters before = seats.coupling_in_force(seat);
  seats.on_update(seat, update);
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
    if (connection->is_in(seats) && connection.get() != except) send(*connection, message);
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
    log("closed", connection.label() + " closed: " + text);
    return;
  }
  log("left", connection.label() + " left room " + connection.seats->room().name() + ": " + text);
  const haptics::CouplingParameters before = connection.seats->coupling();
  connection.seats->leave(connection.seat);
  for (const proto::CouplingField& field : proto::kCouplingFields) {
    if (before.*field.value != connection.seats->coupling().*field.value) announce_parameter(connection, 0, field);
  }
  broadcast(*connection.seats, user_left(connection.seat, reason), &connection);
}

void SessionHub::Impl::sweep() {
  std::erase_if(connections, [](const auto& entry) { return entry.second->state == ConnectionState::kClosed; });
}

Connection* SessionHub::Impl::find(ConnectionHandle handle) {
  const auto found = connections.find(handle);
  return found == connections.end() ? nullptr : found->second.get();
}

SessionHub::SessionHub(HubSettings settings, const std::vector<Room*>& rooms, ServerTransport& transport)
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
  impl_->counters.count_received(impl_->take_datagram(datagram, now, may_belong_to, accepted));
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
