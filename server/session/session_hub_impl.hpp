// Private to this folder: the connections of a SessionHub. Its functions are in four sources:
//   session_hub.cpp      connections as a whole: accept, send, state in, time-outs, end
//   session_updates.cpp  state out
//   session_control.cpp  control messages from clients
//   session_poses.cpp    control messages about poses of molecules
#pragma once

#include <bitset>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "proto/control_framing.hpp"
#include "proto/coupling_fields.hpp"
#include "server/session/session_answers.hpp"
#include "server/session/session_hub.hpp"
#include "server/session/shared_turns.hpp"
#include "server/session/state_stream.hpp"

namespace tandem::server {

/// Limits shared by the connections of one address.
struct AddressUse {
  net::TokenBucket control{kAddressControlRate};
  std::size_t connections = 0;
};

/// Join that waits until the use of its token is on disk.
struct HeldJoin {
  wire::ClientControl granted;
  Admission::Ticket ticket;
};

struct Connection {
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
  std::unique_ptr<HeldJoin> held_join;  ///< kJoining: until the token's use is written; blocks other messages

  // kActive
  LocalTime joined{};
  std::string user_name;
  RoomSeats* seats = nullptr;
  Seat seat;
  proto::ChannelCounters counters;  ///< counts of the stream since the last collect()
  std::uint64_t bodies_thinned = 0;
  std::optional<StateStream> stream;
  net::TokenBucket updates{kUpdateRate};
  net::TokenBucket poses{kUserPoseRate};
  net::TokenBucket points{kUserPointRate};
  bool wants_soft_shapes = false;
  std::map<std::uint32_t, std::string> sent_soft_shapes;  ///< last sent offsets, by soft body
  std::optional<Admission::Id> credential;                ///< for a later resume by the user
  // News not sent to the user yet.
  bool has_new_law = false;
  std::bitset<proto::kCouplingFields.size()> changed_parameters;  ///< coefficients changed by others or by a grip
  std::vector<wire::ServerControl> presence;                      ///< joins and leaves not sent yet, in order

  std::string label() const {
    if (seats == nullptr) return "connection " + std::to_string(handle);
    return "user " + std::to_string(seat.user.value) + " " + quoted(user_name);
  }
  /// Marks the coefficients in force that differ from `before`, so that the user is notified.
  void note_changes(const haptics::CouplingParameters& before);
  bool is_half_open() const { return state == ConnectionState::kGreeting || state == ConnectionState::kJoining; }
  bool is_in(const RoomSeats& room) const { return state == ConnectionState::kActive && seats == &room; }
};

// A connection that ends is only marked kClosed; sweep() erases it when the outermost call is done, so that
// loops over the connections may end any of them.
struct SessionHub::Impl {
  Impl(SessionHub& owner, HubSettings hub_settings, const std::vector<Room*>& hub_rooms,
       ServerTransport& hub_transport);

  // session_control.cpp
  void receive_control_bytes(Connection& connection, std::span<const std::byte> bytes, LocalTime now);
  void serve(Connection& connection, LocalTime now);
  void serve_waiting(LocalTime now);
  bool has_turn(const Connection& connection, LocalTime now) const;
  bool can_afford(Connection& connection, const wire::ClientControl& message, LocalTime now);
  void handle(Connection& connection, const wire::ClientControl& message, LocalTime now);
  bool handle_in_any_state(Connection& connection, const wire::ClientControl& message);
  bool handle_active(Connection& connection, const wire::ClientControl& message, LocalTime now);
  void greet(Connection& connection, const wire::ClientControl& message);
  void join(Connection& connection, const wire::ClientControl& message);
  bool admit_user(Connection& connection, std::uint32_t request, wire::JoinRoom& wanted, Admission::Ticket& ticket);
  void join_as_granted(Connection& connection, const wire::ClientControl& message, const Admission::Ticket& ticket);
  void assign_seat(Connection& connection, const wire::ClientControl& message, RoomSeats& seats,
                   const Admission::Ticket& ticket);
  void hold(Connection& connection, const wire::ClientControl& message, const Admission::Ticket& ticket);
  void settle(Connection& connection);
  void give_credential(Connection& connection, const wire::JoinRoom& granted, const Admission::Ticket& ticket,
                       wire::Joined& joined);
  void introduce(Connection& newcomer);
  RoomSeats* find_room(const std::string& name);
  std::string room_names() const;
  void grab_or_release(Connection& connection, const wire::ClientControl& message);
  void kick(Connection& connection, const wire::ClientControl& message);
  void set_parameter(Connection& connection, const wire::ClientControl& message);
  void reset_room(Connection& connection, const wire::ClientControl& message);
  void ask_pose(Connection& connection, const wire::ClientControl& message);
  std::string pose_edit_problem(const Connection& connection, const wire::AskPose& request) const;
  void cancel_minimising(Connection& connection, std::uint32_t request);
  void refuse_unanswered_poses();
  void point(Connection& connection, const wire::ClientControl& message);
  void send_to_room(const Room& room, UserId asker, std::uint32_t request, wire::ServerControl message);
  void set_law(Connection& connection, const wire::ClientControl& message);
  void announce_parameter(Connection& setter, std::uint32_t request, const proto::CouplingField& field);
  void change_coupling(RoomSeats& seats, const std::function<void()>& change, const Connection* but = nullptr);
  void announce_presence(const Connection& subject, const wire::ServerControl& message);
  void send_news(Connection& connection);

  // session_hub.cpp
  void make_room(Connection& newcomer);
  Connection* oldest_half_open(const AddressUse& address, const Connection& but);
  AddressUse& most_half_open(const Connection& but);
  std::size_t half_open_of(const AddressUse& address) const;
  proto::DropReason receive_datagram(std::span<const std::byte> datagram, LocalTime now,
                                     const std::function<bool(ConnectionHandle)>& may_belong_to,
                                     AcceptedDatagram& accepted);
  void send_updates(std::size_t room, const Clock& clock);
  void send_update(Connection& connection, const RoomUpdate& update, LocalTime now);
  void collect(Connection& connection);
  bool deliver_state(Connection& connection, std::span<const std::byte> datagram);
  void note_start(const Connection& connection, bool (RoomStart::*change)(UserId, ServerTime));
  void deliver_events(RoomSeats& seats);
  void send_pose_answers();
  void send_soft_shapes(RoomSeats& seats);
  void send_soft_shape(Connection& connection, const wire::ServerControl& message);
  void apply_room_update(Connection& connection, const RoomUpdate& update);
  void end_overdue(Connection& connection, LocalTime now);

  void send(Connection& connection, const wire::ServerControl& message);
  void send_unchecked(Connection& connection, const wire::ServerControl& message);
  void broadcast(const RoomSeats& seats, const wire::ServerControl& message);
  void refuse(Connection& connection, std::uint32_t request, wire::ErrorCode code, const std::string& text);
  void end(Connection& connection, wire::DisconnectReason reason, const std::string& text, std::uint32_t request = 0);
  void forget(Connection& connection, wire::DisconnectReason reason, const std::string& text);
  void sweep();
  void end_other_device(const Admission::Id& credential, wire::DisconnectReason reason);
  void report_admission();
  Connection* find(ConnectionHandle handle);
  void log(std::string_view kind, const std::string& line) const {
    if (owner.on_log) owner.on_log(kind, line);
  }

  SessionHub& owner;
  HubSettings settings;
  ServerTransport& transport;
  std::optional<Admission> admission;
  std::uint64_t reported_admission = 0;
  std::vector<std::unique_ptr<RoomSeats>> rooms;
  std::deque<SharedTurns> updates;     ///< per room, for its UDP users
  std::vector<Connection*> updated{};  ///< UDP users of the current room
  std::map<ConnectionHandle, std::unique_ptr<Connection>> connections;
  std::unordered_map<ConnectionId, Connection*> active;
  HubCounters counters;
  proto::Bytes frame_out;
  std::map<std::string, AddressUse> addresses;
  net::TokenBucket turn{kTurn};
  ConnectionHandle served_last = 0;
  LocalTime called_at{};  ///< time of the current call
};

}  // namespace tandem::server
