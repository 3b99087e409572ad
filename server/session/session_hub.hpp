// The server side of all connections, without sockets. It receives the incoming bytes and the time as arguments, and
// passes outgoing bytes to ServerTransport. The live server calls it from Asio (server/net), the lab from simulated
// links. proto/STATES.md defines the states of a connection.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/ids.hpp"
#include "common/base/time.hpp"
#include "proto/datagram_channel.hpp"
#include "server/room/room.hpp"
#include "server/session/admission.hpp"
#include "server/session/limits.hpp"

namespace tandem::server {

class PoseKeeper;

/// Handle of a TCP connection, chosen by the transport. It is not 0, and it is not reused while the connection is open.
using ConnectionHandle = std::uint64_t;

/// Interface through which the hub sends. The hub calls it on the io thread, within one of its own functions, unless
/// stated otherwise.
class ServerTransport {
 public:
  virtual ~ServerTransport() = default;
  /// Queues control bytes. All of them are sent, in order.
  virtual void send_control(ConnectionHandle connection, std::span<const std::byte> bytes) = 0;
  /// Sends one state datagram to the source address of the connection's last accepted datagram. Returns false if the
  /// datagram cannot be sent now. It is then discarded, because a newer state follows, and the caller counts the loss.
  /// Thread  io. While the io thread sends updates, the thread in SessionHub::help() calls the function, too, but for a
  ///         different connection
  virtual bool send_datagram(ConnectionHandle connection, std::span<const std::byte> datagram) = 0;
  /// Returns the number of queued control bytes that the kernel has not accepted yet. The hub sends a state over TCP
  /// only if this number is 0, so that no outdated state is queued. It closes a connection with more than
  /// kMaxQueuedControlBytes.
  virtual std::size_t queued_control_bytes(ConnectionHandle connection) const = 0;
  /// Keying material exported from the TLS connection (RFC 8446 §7.5); none if the connection is not encrypted.
  virtual std::optional<secure::Exported> exported(ConnectionHandle, std::string_view /*label*/,
                                                   std::span<const std::byte> /*context*/) {
    return std::nullopt;
  }
  /// Closes the connection after the queued bytes have been sent. The hub has already removed the connection. It
  /// ignores events of this handle that the transport still reports.
  virtual void close(ConnectionHandle connection) = 0;
};

/// States of a connection (proto/STATES.md). An unknown connection counts as kClosed.
enum class ConnectionState : std::uint8_t { kGreeting, kJoining, kActive, kClosed };
std::string_view name_of(ConnectionState state);

struct HubSettings {
  Duration silence_timeout{std::chrono::milliseconds(1500)};  ///< maximum time without a message from a joined user
  Duration hello_timeout{std::chrono::seconds(2)};            ///< maximum time from connecting to the hello
  Duration join_timeout{std::chrono::seconds(5)};             ///< maximum time from connecting to a completed join
  std::size_t max_connections = 64;
  std::uint16_t datagram_port = 0;
  /// Generator of connection ids, which must be unpredictable. LiveServer uses a cryptographic generator, trials use a
  /// seeded one.
  std::function<std::uint64_t()> connection_ids{};
  /// Settings for admission; none if everybody may join (--insecure, trials).
  std::optional<AdmissionSettings> admission{};
  /// Service that saves poses; owned by ServerRooms, must outlive the hub. Null: no poses are saved.
  PoseKeeper* poses = nullptr;
  /// Called on the io thread when a game calls a person, with the name of the room and the reason, "time-limit" or
  /// "state-limit". It must not block.
  std::function<void(const std::string& room, const std::string& reason)> on_call{};
};

/// Result of on_datagram().
struct AcceptedDatagram {
  ConnectionHandle connection = 0;             ///< connection of the datagram; 0 if it was dropped
  std::optional<std::uint64_t> path_answer{};  ///< number in the answer to a path challenge; none for other datagrams
};

struct HubCounters : proto::ChannelCounters {
  std::uint64_t bodies_thinned = 0;
  std::uint64_t joins = 0;
  /// Refused connections and joins, by wire::ErrorCode.
  std::array<std::uint64_t, wire::ErrorCode_ARRAYSIZE> refusals{};
  std::array<std::uint64_t, wire::DisconnectReason_ARRAYSIZE> ends{};  ///< ended connections, by wire::DisconnectReason
  /// Round-trip times by the server's clock, one for each acknowledged state. A client can falsify them: the server
  /// subtracts the time for which the client claims to have held the state.
  Histogram round_trip;
};

class SessionHub {
 public:
  /// Fails   std::invalid_argument if connection_ids is empty, or if the description of a scene does not fit into a
  ///         control message
  SessionHub(HubSettings settings, const std::vector<Room*>& rooms, ServerTransport& transport);
  ~SessionHub();

  /// Adds a connection that the transport has accepted.
  /// In      address  address of the peer without the port; connections from the same address share limits (limits.hpp)
  void on_connected(ConnectionHandle connection, LocalTime now, const std::string& address = "");
  void on_control_bytes(ConnectionHandle connection, std::span<const std::byte> bytes, LocalTime now);
  /// Ends a lost TCP connection. Its user leaves the room, and the user's tool releases the held body.
  void on_disconnected(ConnectionHandle connection, LocalTime now, const std::string& why = "the connection was lost");
  /// Handles a datagram from any source. A dropped datagram is counted but not answered. If the datagram is accepted,
  /// the transport may use its source address as the address of the user.
  /// In      may_belong_to  returns false for a connection from which the datagram cannot come, because the address of
  ///                        the peer differs
  AcceptedDatagram on_datagram(std::span<const std::byte> datagram, LocalTime now,
                               const std::function<bool(ConnectionHandle)>& may_belong_to);
  /// Returns a path challenge, a datagram whose receiver must return `number`. It is empty if the user has not joined
  /// or if datagrams are not sealed. It is valid until the next call for this connection.
  std::span<const std::byte> path_challenge(ConnectionHandle connection, std::uint64_t number, LocalTime now);

  /// Sends all updates that rooms have published since the last call. Then delivers the events of rooms, ends silent
  /// connections, and handles waiting control messages of the connections in turn (limits.hpp).
  /// In      clock  read again for the time stamp of each update, because sending the updates before it takes time
  void poll(const Clock& clock);
  /// Sends some of the updates of a room that has just published, in parallel with poll() on the io thread. The calling
  /// thread must not block, because poll() waits for the sends that it has begun.
  /// Thread  room
  void help(const Room& room);
  /// Refuses all requests that services have not begun, and all later ones. poll() sends the answers.
  void begin_stop();
  /// Returns whether a request to a service has not been answered yet.
  bool owes_answers() const;
  /// Refuses the unanswered requests, then ends all connections (DISCONNECT_SERVER_STOPPING).
  void stop(LocalTime now);

  /// Returns whether received messages of the connection wait in the hub for a later poll(). The transport must then
  /// not read from the connection.
  bool is_behind(ConnectionHandle connection) const;
  ConnectionState state_of(ConnectionHandle connection) const;
  std::size_t connection_count() const;
  /// Returns the number of users in all rooms, without sources of signals.
  std::size_t user_count() const;
  /// Number of users in a room, by UserRole. `room` is an index into the constructor's list of rooms.
  std::array<std::size_t, 3> users_in(std::size_t room) const;
  const HubCounters& counters() const;
  /// Called on the io thread with one log line per event, for example a join, a leave, or a refusal with its reason.
  std::function<void(std::string_view kind, const std::string& line)> on_log;
  /// Called within poll() and stop() if the state to be saved for the next start has changed.
  std::function<void(const wire::AdmissionState&)> on_admission;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
