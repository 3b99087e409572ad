// The server's side of every connection, without sockets: bytes and time come in, bytes leave through ServerTransport.
// The live server drives it from Asio (server/net), the lab from simulated links. proto/STATES.md defines the states of
// a connection.
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

/// TCP connection of the transport. The transport chooses the handle; it is not 0 and never reused while open.
using ConnectionHandle = std::uint64_t;

/// Send interface of the hub. Called on the io thread, from inside the hub's calls.
class ServerTransport {
 public:
  virtual ~ServerTransport() = default;
  /// Queues control bytes, whole and in order.
  virtual void send_control(ConnectionHandle connection, std::span<const std::byte> bytes) = 0;
  /// Sends one state datagram to the source address of that connection's last accepted datagram. Freshest-only: false
  /// when it cannot be sent now; the datagram is then lost, and the caller counts it.
  /// Thread  io; while io only sends, also the thread in SessionHub::help(), for another connection
  virtual bool send_datagram(ConnectionHandle connection, std::span<const std::byte> datagram) = 0;
  /// Control bytes that the connection has not taken yet. The hub sends state over TCP only when it is 0
  /// (freshest-only), and ends a connection whose reader exceeds kMaxQueuedControlBytes.
  virtual std::size_t queued_control_bytes(ConnectionHandle connection) const = 0;
  /// Keying material exported from the connection's TLS (RFC 8446 §7.5); nothing if it is not encrypted.
  virtual std::optional<secure::Exported> exported(ConnectionHandle, std::string_view /*label*/,
                                                   std::span<const std::byte> /*context*/) {
    return std::nullopt;
  }
  /// Closes after the queued bytes have been sent. The hub has already dropped the connection; later calls about it are
  /// optional and ignored.
  virtual void close(ConnectionHandle connection) = 0;
};

/// States of a connection (proto/STATES.md). kClosed: unknown, or ended.
enum class ConnectionState : std::uint8_t { kGreeting, kJoining, kActive, kClosed };
std::string_view name_of(ConnectionState state);

struct HubSettings {
  Duration silence_timeout{std::chrono::milliseconds(1500)};  ///< after joining, without state and control
  Duration hello_timeout{std::chrono::seconds(2)};            ///< from connecting to hello
  Duration join_timeout{std::chrono::seconds(5)};             ///< from connecting to joined
  std::size_t max_connections = 64;
  std::uint16_t datagram_port = 0;
  /// Source of connection ids. They must not be guessable: the live server uses a cryptographic source (LiveServer),
  /// trials a seeded one.
  std::function<std::uint64_t()> connection_ids{};
  /// Rules for joining; none: everybody may join (--insecure, trials).
  std::optional<AdmissionSettings> admission{};
  /// Service of the rooms (ServerRooms), destroyed after the hub; null: no poses are kept.
  PoseKeeper* poses = nullptr;
};

/// Result of on_datagram().
struct AcceptedDatagram {
  ConnectionHandle connection = 0;             ///< 0: the datagram was dropped
  std::optional<std::uint64_t> path_answer{};  ///< number returned by a path answer; none for state
};

struct HubCounters : proto::ChannelCounters {
  std::uint64_t bodies_thinned = 0;
  std::uint64_t joins = 0;
  std::array<std::uint64_t, wire::ErrorCode_ARRAYSIZE> refusals{};     ///< connections and joins, by wire::ErrorCode
  std::array<std::uint64_t, wire::DisconnectReason_ARRAYSIZE> ends{};  ///< connections, by wire::DisconnectReason
  /// For each accepted input, measured at this end. A client can falsify it, because it reports part of it.
  Histogram round_trip;
};

class SessionHub {
 public:
  /// Fails   std::invalid_argument: connection_ids is empty, or a scene's description is too long for the wire
  SessionHub(HubSettings settings, const std::vector<Room*>& rooms, ServerTransport& transport);
  ~SessionHub();

  /// In      address  peer address without the port; connections from one address share limits
  void on_connected(ConnectionHandle connection, LocalTime now, const std::string& address = "");
  void on_control_bytes(ConnectionHandle connection, std::span<const std::byte> bytes, LocalTime now);
  /// Ends a lost TCP connection: the user leaves the room, and the tool releases its body.
  void on_disconnected(ConnectionHandle connection, LocalTime now, const std::string& why = "the connection was lost");
  /// Handles a datagram from any source. Dropped datagrams are counted, not answered. The transport may remember the
  /// source of an accepted one. `may_belong_to` lets the transport veto a connection (wrong peer address).
  AcceptedDatagram on_datagram(std::span<const std::byte> datagram, LocalTime now,
                               const std::function<bool(ConnectionHandle)>& may_belong_to);
  /// Datagram that asks its receiver to return `number`; empty if the connection has no state or no sealing. Valid
  /// until the next call for that connection.
  std::span<const std::byte> path_challenge(ConnectionHandle connection, std::uint64_t number, LocalTime now);

  /// Sends every update that rooms have published since the last call. Then delivers room events, ends silent
  /// connections, and serves waiting control messages in turn (limits.hpp).
  /// In      clock  read again for each update to stamp it, because sending the others takes time
  void poll(const Clock& clock);
  /// Helps poll() to send the updates of a room that has just published. The io thread waits for sends begun here, so
  /// the calling thread must not block.
  /// Thread  the room's
  void help(const Room& room);
  /// Refuses all requests to services that are not started and all later ones; poll() sends the answers.
  void begin_stop();
  /// Whether a request to a service is still unanswered.
  bool owes_answers() const;
  /// Ends all connections (DISCONNECT_SERVER_STOPPING), after refusing the unanswered requests.
  void stop(LocalTime now);

  /// Whether messages of that connection wait for a later turn; until then, read no more from it.
  bool is_behind(ConnectionHandle connection) const;
  ConnectionState state_of(ConnectionHandle connection) const;
  std::size_t connection_count() const;
  std::size_t user_count() const;
  /// Number of users in a room by UserRole; rooms are numbered as in the constructor.
  std::array<std::size_t, 3> users_in(std::size_t room) const;
  const HubCounters& counters() const;
  /// Log sink, one line per noteworthy event (joined, left or refused with the reason). Called on the io thread.
  std::function<void(std::string_view kind, const std::string& line)> on_log;
  /// Called within poll() and stop() when the state to save across restarts has changed.
  std::function<void(const wire::AdmissionState&)> on_admission;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
