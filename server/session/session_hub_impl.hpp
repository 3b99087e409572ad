// Implementation of SessionHub, private to this folder. Its functions are in four sources:
//   session_hub.cpp      connections in general: accepting, sending, received state, time-outs, ending
//   session_updates.cpp  sending of state
//   session_control.cpp  received control messages: rate limits, and the choice of the service that handles them
//   session_join.cpp     joining: admission, seats, credentials
// Services handle the requests of joined users (services/service.hpp).
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "proto/control_framing.hpp"
#include "server/session/services/service.hpp"
#include "server/session/session_answers.hpp"
#include "server/session/session_hub.hpp"
#include "server/session/shared_turns.hpp"
#include "server/session/state_stream.hpp"

namespace tandem::server {

/// Current use of the limits that all connections of one address share.
struct AddressUse {
  net::TokenBucket control{kAddressControlRate};
  std::size_t connections = 0;
};

struct Connection final : SessionUser {
  ConnectionHandle handle = 0;
  ConnectionState state = ConnectionState::kGreeting;
  ConnectionId id;
  std::uint8_t epoch = 0;
  LocalTime connected{};
  LocalTime last_received{};
  AddressUse* address = nullptr;
  proto::FrameReader reader{proto::kMaxClientControlBytes};
  net::TokenBucket control{kControlRate};
  net::TokenBucket turn{kConnectionTurn};
  bool state_over_tcp = false;

  // Members used only in the state kJoining.
  Admission::Ticket ticket;  ///< ticket of the last admitted join
  /// Join that is held until the use of its token is on disk. Later messages of the connection are held as well.
  std::optional<wire::ClientControl> held_join;

  // Members used only in the state kActive.
  LocalTime joined{};
  proto::ChannelCounters counters;  ///< counters of `stream` since the last collect()
  std::uint64_t bodies_thinned = 0;
  std::optional<StateStream> stream;  ///< none for a source of signals
  net::TokenBucket updates{kUpdateRate};
  std::optional<Admission::Id> credential;  ///< credential with which the user can resume
  // Notifications that have not been sent to the user yet.
  std::vector<wire::ServerControl> presence;                         ///< joins and leaves of other users, in order
  std::map<std::size_t, std::function<wire::ServerControl()>> news;  ///< other notifications; see announce()

  std::string label() const { return seats == nullptr ? "connection " + std::to_string(handle) : SessionUser::label(); }
  bool is_half_open() const { return state == ConnectionState::kGreeting || state == ConnectionState::kJoining; }
  /// Returns whether the connection has a seat of the room; a source of signals has none.
  bool is_in(const Room& of) const { return state == ConnectionState::kActive && !is_source() && &room() == &of; }
};

// Ending a connection only marks it as kClosed. sweep() erases it at the end of the outermost call of the hub. A loop
// over the connections may therefore end any connection.
struct SessionHub::Impl final : ServiceHost {
  Impl(SessionHub& owner, HubSettings hub_settings, const std::vector<Room*>& hub_rooms,
       ServerTransport& hub_transport);

  // Functions in session_control.cpp.
  void receive_control(Connection& connection, std::span<const std::byte> bytes);
  void serve(Connection& connection);
  void serve_waiting();
  bool has_turn(const Connection& connection) const;
  bool can_afford(Connection& connection, const wire::ClientControl& message);
  void handle(Connection& connection, const wire::ClientControl& message);
  bool handle_in_any_state(Connection& connection, const wire::ClientControl& message);
  bool handle_active(Connection& connection, const wire::ClientControl& message);
  void greet(Connection& connection, const wire::ClientControl& message);

  // Functions in session_join.cpp.
  void join(Connection& connection, const wire::ClientControl& message);
  bool admit_user(Connection& connection, std::uint32_t request, wire::JoinRoom& wanted);
  void join_as_granted(Connection& connection, const wire::ClientControl& message);
  void hold(Connection& connection, const wire::ClientControl& message);
  void settle(Connection& connection);
  void admit_source(Connection& connection, const wire::ClientControl& message, RoomSeats& seats);
  void assign_seat(Connection& connection, const wire::ClientControl& message, RoomSeats& seats);
  void give_credential(Connection& connection, const wire::JoinRoom& granted, wire::Joined& joined);
  void introduce(Connection& newcomer, const wire::JoinRoom& granted);
  void announce_presence(const Connection& subject, const wire::ServerControl& message);
  void end_other_device(const Admission::Id& credential, wire::DisconnectReason reason);
  void publish_admission();

  // Functions in session_hub.cpp.
  void make_room(Connection& newcomer);
  proto::DropReason receive_datagram(std::span<const std::byte> datagram,
                                     const std::function<bool(ConnectionHandle)>& may_belong_to,
                                     AcceptedDatagram& accepted);
  void note_start(const Connection& connection, bool (RoomStart::*change)(UserId, ServerTime));
  void end_overdue(Connection& connection);
  void send_unchecked(Connection& connection, const wire::ServerControl& message);
  void refuse_connection(Connection& connection, std::uint32_t request, wire::ErrorCode code, const std::string& text);
  void close(Connection& connection, wire::DisconnectReason reason, const std::string& text, std::uint32_t request);
  void forget(Connection& connection, wire::DisconnectReason reason, const std::string& text);
  void sweep();
  Connection* find(ConnectionHandle handle);

  // Functions in session_updates.cpp.
  void send_updates(std::size_t room, const Clock& clock);
  void send_update(Connection& connection, const RoomUpdate& update, LocalTime now);
  void collect(Connection& connection);
  bool deliver_state(Connection& connection, std::span<const std::byte> datagram);

  // Interface for services. Each SessionUser is a Connection, so the casts are safe.
  LocalTime now() const override { return called_at; }
  const std::vector<std::unique_ptr<RoomSeats>>& rooms() const override { return room_seats; }
  std::vector<SessionUser*> users_of(const Room& room) const override;
  void send(SessionUser& user, const wire::ServerControl& message) override;
  std::size_t queued_bytes(const SessionUser& user) const override;
  void announce(SessionUser& user, std::size_t key, std::function<wire::ServerControl()> make) override;
  void send_news(SessionUser& user) override;
  void end(SessionUser& user, wire::DisconnectReason reason, const std::string& text) override;
  void log(std::string_view kind, const std::string& line) const override {
    if (owner.on_log) owner.on_log(kind, line);
  }

  SessionHub& owner;
  HubSettings settings;
  ServerTransport& transport;
  std::optional<Admission> admission;
  std::uint64_t published_admission = 0;  ///< Admission::changes() at the last on_admission()
  std::vector<std::unique_ptr<RoomSeats>> room_seats;
  std::vector<std::unique_ptr<SessionService>> services;  ///< services, in the order in which they notify users
  std::map<SessionService::Case, SessionService*> handlers;
  std::deque<SharedTurns> updates;     ///< parallel loops that send updates to UDP users; one for each room
  std::vector<Connection*> updated{};  ///< users of one room who receive datagrams; used only while send_updates() runs
  std::map<ConnectionHandle, std::unique_ptr<Connection>> connections;
  std::unordered_map<ConnectionId, Connection*> active;
  HubCounters counters;
  proto::Bytes frame_out;
  std::map<std::string, AddressUse> addresses;
  net::TokenBucket turn{kTurn};
  ConnectionHandle served_last = 0;
  LocalTime called_at{};  ///< time of the current call of the hub
};

}  // namespace tandem::server
