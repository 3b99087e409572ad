#include "server/session/session_hub.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/base/units.hpp"
#include "server/session/services/services.hpp"
#include "server/session/session_hub_impl.hpp"

namespace tandem::server {
namespace {

using Connections = std::map<ConnectionHandle, std::unique_ptr<Connection>>;  // ordered by the time of connecting

std::size_t half_open_of(const AddressUse& address, const Connections& connections) {
  return static_cast<std::size_t>(std::ranges::count_if(connections, [&address](const auto& entry) {
    return entry.second->address == &address && entry.second->is_half_open();
  }));
}

Connection* oldest_half_open(const AddressUse& address, const Connection& newcomer, const Connections& connections) {
  for (const auto& [handle, connection] : connections) {
    const bool is_candidate = connection.get() != &newcomer && connection->is_half_open();
    if (is_candidate && connection->address == &address) return connection.get();
  }
  return nullptr;
}

/// Returns the address with the most connections that have not joined; `newcomer` is not counted. If several addresses
/// have equally many, returns the one that has the oldest of these connections.
AddressUse& most_half_open(const Connection& newcomer, const Connections& connections) {
  AddressUse* most = newcomer.address;
  std::size_t count = 0;
  for (const auto& [handle, connection] : connections) {
    if (connection.get() == &newcomer || !connection->is_half_open()) continue;
    const bool is_newcomers = connection->address == newcomer.address;
    const std::size_t candidates = half_open_of(*connection->address, connections) - (is_newcomers ? 1 : 0);
    if (candidates <= count) continue;
    most = connection->address;
    count = candidates;
  }
  return *most;
}

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
    room_seats.push_back(std::make_unique<RoomSeats>(*room));
  }
  services.push_back(make_grasping(*this));
  services.push_back(make_soft_shapes(*this));
  services.push_back(make_games(*this, settings.on_call));
  services.push_back(make_poses(*this, settings.poses));
  services.push_back(make_coupling(*this));
  services.push_back(make_moderation(*this, settings.poses));
  services.push_back(make_pointing(*this));
  services.push_back(make_signals(*this));
  services.push_back(make_assets(*this));
  for (const auto& service : services) {
    for (const SessionService::Case message : service->cases()) handlers[message] = service.get();
  }
}

/// Enforces the limits of connections, in total and per address, after `newcomer` has connected. At a limit, closes the
/// oldest connection that has not joined. At the total limit, this connection belongs to the address with the most such
/// connections. If there is none, the newcomer is refused.
void SessionHub::Impl::make_room(Connection& newcomer) {
  const bool is_full = connections.size() > settings.max_connections;
  if (!is_full && half_open_of(*newcomer.address, connections) <= kMaxHalfOpen) return;
  const AddressUse& crowded = is_full ? most_half_open(newcomer, connections) : *newcomer.address;
  if (Connection* oldest = oldest_half_open(crowded, newcomer, connections)) {
    end(*oldest, wire::DISCONNECT_REFUSED, "did not join, and newer connections need the place");
  } else if (is_full) {
    refuse_connection(newcomer, 0, wire::ERROR_SERVER_FULL,
                      "the server has its " + std::to_string(settings.max_connections) + " connections; try later");
  }
}

proto::DropReason SessionHub::Impl::receive_datagram(std::span<const std::byte> datagram,
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
  if (connection.state != ConnectionState::kActive || !connection.stream || !connection.stream->is_for(header)) {
    return proto::DropReason::kUnknownConnection;
  }
  if (may_belong_to && !may_belong_to(connection.handle)) return proto::DropReason::kNotAllowed;
  const bool is_state = header.type == proto::DatagramType::kClientUpdate;
  std::uint64_t path_answer = 0;
  const proto::DropReason reason = is_state ? connection.stream->receive(header, datagram, called_at)
                                            : connection.stream->receive_path(header, datagram, path_answer);
  collect(connection);
  if (reason != proto::DropReason::kNone) return reason;
  connection.last_received = called_at;
  if (!connection.updates.consume(1, called_at)) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR,
        "too many client updates: at most " + std::to_string(static_cast<int>(kUpdateRate.per_second)) + " a second");
    return proto::DropReason::kNotAllowed;
  }
  accepted.connection = connection.handle;
  const auto round_trip = is_state ? connection.stream->pop_round_trip() : std::nullopt;
  if (round_trip && *round_trip >= Duration{0}) counters.round_trip.record(*round_trip);
  if (!is_state) accepted.path_answer = path_answer;
  if (connection.stream->has_hand()) note_start(connection, &RoomStart::add);
  return proto::DropReason::kNone;
}

/// Updates the common start of a room (RoomStart) after the first valid handle pose of a user or after a user has left.
void SessionHub::Impl::note_start(const Connection& connection, bool (RoomStart::*change)(UserId, ServerTime)) {
  RoomSeats& seats = *connection.seats;
  if (!(seats.start().*change)(connection.seat.user, server_time_of_own_clock(called_at))) return;
  const wire::ServerControl message = room_start(seats.start());
  const std::uint32_t awaited = message.room_start().awaited();
  const auto countdown_ms = seats.room().start_settings().countdown / std::chrono::milliseconds(1);
  log("start", "room " + seats.room().name() +
                   (awaited > 0 ? " waits for " + counted(awaited, "more user", "more users")
                                : " begins in " + std::to_string(countdown_ms) + " ms"));
  send_to_room(seats.room(), message);
}

void SessionHub::Impl::end_overdue(Connection& connection) {
  if (connection.state == ConnectionState::kActive) {
    if (called_at - connection.last_received < settings.silence_timeout) return;
    end(connection, wire::DISCONNECT_SILENCE,
        "nothing heard for " + std::to_string(settings.silence_timeout / std::chrono::milliseconds(1)) + " ms");
    return;
  }
  const bool has_greeted = connection.state == ConnectionState::kJoining;
  const Duration allowed = has_greeted ? settings.join_timeout : settings.hello_timeout;
  if (called_at - connection.connected < allowed) return;
  const char* const what = connection.held_join ? "the use of the token could not be written to the server's disk"
                           : has_greeted        ? "did not join"
                                                : "sent no hello";
  end(connection, wire::DISCONNECT_SILENCE,
      std::string(what) + " within " + std::to_string(allowed / std::chrono::milliseconds(1)) + " ms");
}

std::vector<SessionUser*> SessionHub::Impl::users_of(const Room& room) const {
  std::vector<SessionUser*> users;
  for (const auto& [handle, connection] : connections) {
    if (connection->is_in(room)) users.push_back(connection.get());
  }
  return users;
}

void SessionHub::Impl::send(SessionUser& user, const wire::ServerControl& message) {
  auto& connection = static_cast<Connection&>(user);
  if (connection.state == ConnectionState::kClosed) return;
  if (queued_bytes(user) > kMaxQueuedControlBytes) {
    end(user, wire::DISCONNECT_SLOW, "control messages piled up unread");
    return;
  }
  send_unchecked(connection, message);
}

void SessionHub::Impl::send_unchecked(Connection& connection, const wire::ServerControl& message) {
  frame_out.clear();
  proto::append_frame(message, frame_out);
  transport.send_control(connection.handle, frame_out);
}

std::size_t SessionHub::Impl::queued_bytes(const SessionUser& user) const {
  return transport.queued_control_bytes(static_cast<const Connection&>(user).handle);
}

void SessionHub::Impl::announce(SessionUser& user, std::size_t key, std::function<wire::ServerControl()> make) {
  static_cast<Connection&>(user).news[key] = std::move(make);
}

/// Sends the queued notifications, unless the user reads slowly. In the queue, notifications with the same key replace
/// each other, so they do not accumulate.
void SessionHub::Impl::send_news(SessionUser& user) {
  auto& connection = static_cast<Connection&>(user);
  const bool has_news = !connection.presence.empty() || !connection.news.empty();
  if (!has_news || connection.state != ConnectionState::kActive) return;
  if (queued_bytes(user) > kMaxQueuedBeforeNews) return;
  for (const wire::ServerControl& message : std::exchange(connection.presence, {})) send(user, message);
  for (const auto& [key, make] : std::exchange(connection.news, {})) send(user, make());
}

void SessionHub::Impl::refuse_connection(Connection& connection, std::uint32_t request, wire::ErrorCode code,
                                         const std::string& text) {
  ++counters.refusals[static_cast<std::size_t>(code)];
  send(connection, error_answer(request, code, text));
  end(connection, wire::DISCONNECT_REFUSED, text);
}

void SessionHub::Impl::end(SessionUser& user, wire::DisconnectReason reason, const std::string& text) {
  close(static_cast<Connection&>(user), reason, text, 0);
}

/// Ends a connection with a goodbye.
/// In      request  number of the request that is answered by the goodbye; 0 if there is none
void SessionHub::Impl::close(Connection& connection, wire::DisconnectReason reason, const std::string& text,
                             std::uint32_t request) {
  if (connection.state == ConnectionState::kClosed) return;
  forget(connection, reason, text);
  send_unchecked(connection, goodbye(request, reason, text));
  transport.close(connection.handle);
}

void SessionHub::Impl::forget(Connection& connection, wire::DisconnectReason reason, const std::string& text) {
  const bool was_active = connection.state == ConnectionState::kActive;
  connection.state = ConnectionState::kClosed;
  if (std::exchange(connection.held_join, std::nullopt)) admission->release(connection.ticket);
  ++counters.ends[static_cast<std::size_t>(reason)];
  active.erase(connection.id);
  if (!was_active) {
    log("closed", connection.label() + " closed: " + text);
    return;
  }
  // A short stay is logged under a separate kind, because the log limits the lines of each kind.
  const std::string_view kind = called_at - connection.joined < kShortStay ? "left soon" : "left";
  const std::string inputs =
      connection.stream ? "; " + std::to_string(connection.stream->taken()) + " inputs taken" : std::string();
  log(kind, connection.label() + " left room " + connection.room().name() + ": " + text + inputs);
  if (connection.credential && (reason == wire::DISCONNECT_LEFT || reason == wire::DISCONNECT_KICKED)) {
    end_other_device(*connection.credential, reason);
  } else if (connection.credential) {
    // A user who resumes on a new connection ends the old one here. The new connection may still be refused, so the
    // loss of the old one is recorded, and the user can try again.
    admission->note_lost(*connection.credential, called_at);
  }
  connection.seats->leave(connection.seat);
  for (const auto& service : services) service->on_left(connection);
  if (connection.is_source()) return;
  note_start(connection, &RoomStart::remove);
  announce_presence(connection, user_left(connection.seat, reason));
}

void SessionHub::Impl::sweep() {
  const auto erased = std::erase_if(connections, [](const auto& entry) {
    const bool is_closed = entry.second->state == ConnectionState::kClosed;
    if (is_closed) --entry.second->address->connections;
    return is_closed;
  });
  // The entry of an address is kept until its token bucket is full again. Otherwise a client could refill the bucket by
  // reconnecting.
  if (erased == 0 && addresses.size() <= connections.size()) return;
  std::erase_if(addresses, [this](auto& entry) {
    return entry.second.connections == 0 && entry.second.control.is_full(called_at);
  });
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
  if (Connection* found = impl_->find(connection)) impl_->receive_control(*found, bytes);
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
  impl_->counters.count_received(impl_->receive_datagram(datagram, may_belong_to, accepted));
  return accepted;
}

std::span<const std::byte> SessionHub::path_challenge(ConnectionHandle connection, std::uint64_t number,
                                                      LocalTime now) {
  Connection* const found = impl_->find(connection);
  if (found == nullptr || found->state != ConnectionState::kActive || !found->stream) return {};
  return found->stream->path_challenge(number, now);
}

void SessionHub::poll(const Clock& clock) {
  impl_->called_at = clock.now();
  for (std::size_t room = 0; room < impl_->room_seats.size(); ++room) impl_->send_updates(room, clock);
  for (const auto& seats : impl_->room_seats) seats->flush();
  for (const auto& service : impl_->services) service->on_poll();
  if (impl_->admission) impl_->admission->poll(impl_->called_at);
  for (const auto& [handle, connection] : impl_->connections) {
    if (connection->held_join) impl_->settle(*connection);
    impl_->send_news(*connection);
    if (connection->state != ConnectionState::kClosed) impl_->end_overdue(*connection);
  }
  impl_->serve_waiting();
  impl_->sweep();
  impl_->publish_admission();
}

void SessionHub::begin_stop() {
  for (const auto& service : impl_->services) service->begin_stop();
}

bool SessionHub::owes_answers() const {
  return std::ranges::any_of(impl_->services, &SessionService::owes_answers);
}

void SessionHub::stop(LocalTime now) {
  impl_->called_at = now;
  for (const auto& service : impl_->services) service->refuse_unanswered();
  for (const auto& [handle, connection] : impl_->connections) {
    impl_->end(*connection, wire::DISCONNECT_SERVER_STOPPING, "the server is stopping");
  }
  impl_->sweep();
  impl_->publish_admission();
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
  for (const auto& [handle, connection] : impl_->connections) {
    count += connection->state == ConnectionState::kActive && !connection->is_source();
  }
  return count;
}

std::array<std::size_t, 3> SessionHub::users_in(std::size_t room) const {
  std::array<std::size_t, 3> users{};
  for (const SessionUser* user : impl_->users_of(impl_->room_seats[room]->room())) {
    ++users[static_cast<std::size_t>(user->seat.role)];
  }
  return users;
}

const HubCounters& SessionHub::counters() const {
  return impl_->counters;
}

}  // namespace tandem::server
