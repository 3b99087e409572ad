// The client's end of its connection, without a socket: receives bytes and time, sends bytes through ClientTransport.
// Asio (client/net) drives it live, simulated links drive it in the lab.
//
//   haptic thread                         io thread
//   ClientUpdate ──mailbox (outbox)──▶    poll(): encode and send the newest
//   ◀──mailbox (inbox)── ReceivedUpdate   on_datagram(): check, decode, keep the newest
//   ◀──mailbox (scene)── HapticScene      on Joined and ParameterSet
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/exchange/mailboxes.hpp"
#include "client/haptics/coupling_check.hpp"
#include "client/haptics/hand_workspace.hpp"
#include "client/session/asset_plan.hpp"
#include "client/session/command.hpp"
#include "client/session/event.hpp"
#include "client/session/session_status.hpp"
#include "common/base/time.hpp"
#include "common/haptics/coupling/rendered_coupling.hpp"
#include "common/net/clock_sync.hpp"
#include "common/net/text.hpp"
#include "common/realtime/mailbox.hpp"
#include "proto/datagram_channel.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Sending interface of the session. After close(), it must report nothing about the closed connection.
class ClientTransport {
 public:
  virtual ~ClientTransport() = default;
  /// Starts (or restarts) the TCP connection; on_connected() or on_disconnected() follows.
  virtual void connect(LocalTime now) = 0;
  virtual void send_control(std::span<const std::byte> bytes) = 0;
  /// Sends a datagram; returns false if it could not be sent now. Never queues it.
  virtual bool send_datagram(std::span<const std::byte> datagram) = 0;
  /// Keying material exported from the connection's TLS (RFC 8446 §7.5); none without encryption.
  virtual std::optional<secure::Exported> exported(std::string_view /*label*/, std::span<const std::byte> /*context*/) {
    return std::nullopt;
  }
  /// Sets the server's datagram port, from its Welcome.
  virtual void set_datagram_port(std::uint16_t port) = 0;
  /// Number of control bytes that the connection has not accepted yet. With state over TCP, state is sent only when it
  /// is 0.
  virtual std::size_t queued_control_bytes() const = 0;
  /// Results so far of the addresses that connect() tries, as text for the user; empty: there is only one.
  virtual std::string connecting_to() const { return {}; }
  /// Closes after sending the queued bytes, as far as that does not block.
  virtual void close() = 0;
};

struct SessionSettings {
  std::string room = "";  ///< "": the server's only room
  std::string user_name = "user";
  wire::Role role = wire::ROLE_MANIPULATOR;
  proto::Bytes token{};  ///< one-time invitation token (proto/join_token.hpp); sent only over an encrypted connection
  bool state_over_tcp = false;  ///< for networks that block UDP
  Duration silence_timeout{std::chrono::milliseconds(1500)};
  Duration setup_timeout{std::chrono::seconds(5)};  ///< for each of connecting, greeting and joining
  /// Without a haptic update for this long, the last one is repeated without a handle.
  Duration keep_alive{std::chrono::milliseconds(50)};
  /// A repeated update keeps the buttons for this long: a short stall releases nothing, a dead haptic thread holds
  /// nothing.
  Duration buttons_kept{std::chrono::milliseconds(250)};
  Duration reconnect_delay{std::chrono::milliseconds(250)};  ///< first delay; doubled up to reconnect_delay_max
  Duration reconnect_delay_max{std::chrono::seconds(2)};
  bool may_reconnect = true;               ///< reconnects a lost connection that had joined
  std::vector<std::string> asset_kinds{};  ///< kinds of proto/WIRE.md to fetch; others stay at the server
  bool wants_soft_shapes = false;          ///< receives the shapes of soft bodies, for a window
  /// Kinds that are only drawn. The smallest "drawing" of each surface is fetched before all asset_kinds, the rest
  /// after them.
  std::vector<std::string> drawn_asset_kinds{};
  bool fetches_one_at_a_time = false;  ///< requests one piece at a time; for comparison in the lab
  /// Queried for assets before the server, and stores the fetched ones; null: fetched assets last as long as the
  /// session.
  std::shared_ptr<AssetStore> asset_store{};
  /// Weber fraction (common/net/deadband.hpp), for both directions: smaller changes are not sent at once. 0: all
  /// changes are sent.
  double deadband = 0;
  /// The user's changes of the scene's workspace mapping.
  WorkspaceSettings workspace{};
  bool has_nudges = true;  ///< nudges the hand towards a place that another user points at; false: shown only
  /// Upper bounds of the coupling by the user's device, in its newtons and metres. The server applies them to the tool,
  /// too.
  haptics::CouplingParameters coupling_bounds = haptics::kNoCouplingBounds;
  /// Device with which the scene's coupling is checked (CouplingWatch). An unstable coupling is not displayed, but the
  /// hand still drives its tool. None: no check.
  std::optional<devices::DeviceProfile> device{};
};

struct SessionCounters : proto::ChannelCounters {
  std::uint64_t bytes_sent = 0;
  std::uint64_t bytes_received = 0;
  std::uint64_t reconnects = 0;
  std::uint64_t refused_settings = 0;  ///< parameters and laws that the server refused to set
};

using net::printable;

class Credentials;

class ClientSession {
 public:
  ClientSession(SessionSettings settings, ClientTransport& transport, ClientMailboxes& mailboxes);
  ~ClientSession();

  /// Replaces the settings' token; call before start().
  void set_credentials(const Credentials& credentials);
  void start(LocalTime now);
  void on_connected(LocalTime now);
  void on_disconnected(LocalTime now, const std::string& why);
  void on_control_bytes(std::span<const std::byte> bytes, LocalTime now);
  void on_datagram(std::span<const std::byte> datagram, LocalTime now);
  /// Sends the newest haptic update if there is one; checks time-outs and reconnects. Must be called after every haptic
  /// tick, and every few milliseconds when no ticks run.
  void poll(LocalTime now);

  /// Performs a command. What it requests of the server is sent while the session is in a room, otherwise ignored.
  void send(const SessionCommand& command, LocalTime now);
  void leave(LocalTime now);
  /// Ends the session because of a fault of this program; the force ends, too.
  void fail(const std::string& why);
  /// Fetches assets of these kinds from now on; asset_level() and on_assets then refer to them.
  void set_asset_kinds(std::vector<std::string> kinds);
  /// Availability of the assets; kNone outside a room.
  AssetLevel asset_level() const;

  const SessionStatus& status() const;
  /// The scene and this user's place in it, from the last Joined; null before the first.
  const wire::Joined* joined() const;
  /// HapticScene::generation of the last join; 0: none.
  std::uint32_t scene_generation() const;
  /// Coupling coefficients of this user's tool, as last received.
  const haptics::CouplingParameters& coupling() const;
  /// Coupling law of the room, as last received; the default law before the first join.
  const haptics::CouplingLawInfo& law() const;
  /// Last check of the current coupling; explained() gives its findings.
  const CouplingCheck& coupling_check() const;
  /// True in a room once a state has been received since the last join.
  bool has_state() const;
  /// The requested room or, without a request, the only room of the last Welcome; "" before that.
  const std::string& room() const;
  /// Rooms of the last Welcome.
  const std::vector<std::string>& rooms() const;
  /// Shapes of the scene's soft bodies, as last received: offsets of proto::soft_lattice(). Null: none received.
  const std::vector<std::shared_ptr<const std::vector<Vec3>>>& soft_offsets() const;
  /// Whether places that other users point at nudge the hand.
  bool has_nudges() const;
  /// Last place that each user pointed at, with its time; shown for kPointed.
  const std::vector<std::pair<LocalTime, wire::Pointed>>& pointed() const;
  static constexpr Duration kPointed = std::chrono::seconds(5);
  /// Checked poses of the room's two molecules, ascending by number; null: none received.
  const std::shared_ptr<const std::vector<wire::KeptPose>>& kept_poses() const;
  /// Start of this user's hand, in the scene of the last join.
  const HandStart& hand_start() const;
  /// Progress of the running minimisation in the room; none: none is running.
  const std::optional<wire::PoseProgress>& pose_progress() const;
  /// Credentials for a second device of the user; null: not needed or not available, it joins as a separate user.
  std::shared_ptr<const Credentials> credentials_beside() const;
  /// Other users in the room.
  const std::vector<wire::UserJoined>& users() const;
  /// Verified bytes of the scene's files by their SHA-256; kept across reconnects, as are partially received files.
  /// Fetched in the background at a rate that leaves room for state (common/net/fetch_rate.hpp). The coarse
  /// replacements of large assets are fetched first (AssetInfo.coarse_of).
  const AssetMap& assets() const;
  net::ClockSync& clock_sync();
  const SessionCounters& counters() const;
  /// Receives each event. Called on the io thread from inside the functions above, as are the functions below; none of
  /// them may call this session.
  std::function<void(const Event&)> on_event;
  /// Returns why a valid scene cannot be displayed, else empty. A reason ends the session as a set-up error.
  std::function<std::string(const wire::Joined&)> find_scene_problem;
  /// Called when asset_level() has risen: once or twice for each join.
  std::function<void()> on_assets;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
