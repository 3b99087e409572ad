// The server's side of every connection, without a socket: bytes and time come in, bytes go out through
// ServerTransport. The live server drives it from Asio (server/net), the lab from simulated links.
// The states of a connection are those of proto/STATES.md.
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
#include "server/recording/pose_keeper.hpp"
#include "server/room/room.hpp"
#include "server/session/admission.hpp"
#include "server/session/limits.hpp"

namespace tandem::server {

/// A TCP connection of the transport; chosen by it, never reused while open, not 0.
using ConnectionHandle = std::uint64_t;

/// How the hub sends. Called on the io thread, from inside the hub's calls.
class ServerTransport {
 public:
  virtual ~ServerTransport() = default;
  /// Queues control bytes, in order and whole.
  virtual void send_control(ConnectionHandle connection, std::span<const std::byte> bytes) = 0;
  /// Sends one state datagram to where that connection's last accepted datagram came from. Freshest-only:
  /// false when it could not be sent now (it is then lost, and counted by the caller).
  /// Thread  io; or who helps it (SessionHub::help()), for another connection, while io does nothing but this
  virtual bool send_datagram(ConnectionHandle connection, std::span<const std::byte> datagram) = 0;
  /// Control bytes that the connection has not taken yet. The hub sends state over TCP only when it is 0
  /// (freshest-only), and ends a connection whose reader lets kMaxQueuedControlBytes pile up.
  virtual std::size_t queued_control_bytes(ConnectionHandle connection) const = 0;
  /// What the connection's TLS exports (RFC 8446 §7.5); nothing where it is not encrypted.
  virtual std::optional<secure::Exported> exported(ConnectionHandle, std::string_view /*label*/,
                                                   std::span<const std::byte> /*context*/) {
    return std::nullopt;
  }
  /// Closes after what is queued has been sent. The hub has forgotten the connection by then: no call about it
  /// need follow, and one that does is ignored.
  virtual void close(ConnectionHandle connection) = 0;
};

/// States of a connection (proto/STATES.md). kClosed: unknown, or ended.
enum class ConnectionState : std::uint8_t { kGreeting, kJoining, kActive, kClosed };
std::string_view name_of(ConnectionState state);

struct HubSettings {
  Duration silence_timeout{std::chrono::milliseconds(1500)};  ///< after joining: no state and no control for this long
  Duration hello_timeout{std::chrono::seconds(2)};            ///< from connecting to hello
  Duration join_timeout{std::chrono::seconds(5)};             ///< from connecting to having joined
  std::size_t max_connections = 64;
  std::uint16_t datagram_port = 0;
  /// Draws connection ids. They must not be guessed, so live: cryptographic (LiveServer); a seeded one is for trials.
  std::function<std::uint64_t()> connection_ids{};
  /// Who may join; none: everybody (--insecure, trials).
  std::optional<AdmissionSettings> admission{};
  /// Destroyed after the hub: a service of its rooms (ServerRooms); null: no poses are kept.
  PoseKeeper* poses = nullptr;
};

/// A datagram that was taken.
struct AcceptedDatagram {
  ConnectionHandle connection = 0;             ///< 0: it was dropped
  std::optional<std::uint64_t> path_answer{};  ///< it was no state, and says the number of a challenge back
};

struct HubCounters : proto::ChannelCounters {
  std::uint64_t bodies_thinned = 0;
  std::uint64_t joins = 0;
  std::array<std::uint64_t, wire::ErrorCode_ARRAYSIZE> refusals{};     ///< of connections and joins, by wire::ErrorCode
  std::array<std::uint64_t, wire::DisconnectReason_ARRAYSIZE> ends{};  ///< of connections, by wire::DisconnectReason
  Histogram round_trip;  ///< of each input that was taken, as this end measures it; what a client says in it can lie
};

class SessionHub {
 public:
  /// Fails   std::invalid_argument: connection_ids is empty, or a scene's description is too long for the wire
  SessionHub(HubSettings settings, const std::vector<Room*>& rooms, ServerTransport& transport);
  ~SessionHub();

  /// In      address  where it comes from, without a port: those of one address share limits
  void on_connected(ConnectionHandle connection, LocalTime now, const std::string& address = "");
  void on_control_bytes(ConnectionHandle connection, std::span<const std::byte> bytes, LocalTime now);
  /// The TCP connection is gone; the user leaves its room and what it held is let go.
  void on_disconnected(ConnectionHandle connection, LocalTime now, const std::string& why = "the connection was lost");
  /// A datagram from anywhere; one that is dropped is counted, and not answered. Of one that is accepted the transport may
  /// remember where it came from. `may_belong_to` lets the transport veto a connection (wrong peer address).
  AcceptedDatagram on_datagram(std::span<const std::byte> datagram, LocalTime now,
                               const std::function<bool(ConnectionHandle)>& may_belong_to);
  /// A datagram that asks its receiver to say `number` back; empty: that connection has no state, or no seal. Stays until
  /// the next call for that connection.
  std::span<const std::byte> path_challenge(ConnectionHandle connection, std::uint64_t number, LocalTime now);

  /// Sends every update that a room has published since the last call, then delivers room events, ends what has been
  /// silent for too long, and serves control messages that wait, one connection after the other (limits.hpp).
  /// In      clock  asked anew for each update, which says when it was sent: to send the others takes some time
  void poll(const Clock& clock);
  /// Sends some of the updates that poll() is sending, or is about to, of a room that has just published one. Poll() waits for
  /// what is begun here: from no thread that may be held up.
  /// Thread  the room's
  void help(const Room& room);
  /// Refuses requests of poses that nobody has served yet, and those to come; poll() sends the answers.
  void begin_stop();
  /// Some request of poses is not answered yet.
  bool owes_answers() const;
  /// Says goodbye to everybody (DISCONNECT_SERVER_STOPPING). Requests of poses that are not answered yet are refused before.
  void stop(LocalTime now);

  /// Messages of that connection wait for a later turn: read no more of it until then.
  bool is_behind(ConnectionHandle connection) const;
  ConnectionState state_of(ConnectionHandle connection) const;
  std::size_t connection_count() const;
  std::size_t user_count() const;
  /// Of a room, in the order of the constructor, by UserRole.
  std::array<std::size_t, 3> users_in(std::size_t room) const;
  const HubCounters& counters() const;
  /// For logs: one line a noteworthy event (joined, left and why, refused and why). Called on the io thread.
  std::function<void(std::string_view kind, const std::string& line)> on_log;
  /// What must outlive the server has changed; within poll() and stop().
  std::function<void(const wire::AdmissionState&)> on_admission;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
