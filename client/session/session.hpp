// The client's end of its connection to the server, without sockets and clock. The caller passes in received bytes and
// the time; bytes are sent through ClientTransport. A live client uses Asio (client/net), the lab uses simulated links.
//
//   haptic thread                         io thread
//   ClientUpdate ──mailbox (outbox)──▶    poll(): encode and send the newest update
//   ◀──mailbox (inbox)── ReceivedUpdate   on_datagram(): check, decode, publish the newest update
//   ◀──mailbox (scene)── HapticScene      published after Joined and ParameterSet
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
#include "client/session/game_book.hpp"
#include "client/session/session_status.hpp"
#include "common/base/time.hpp"
#include "common/haptics/coupling/rendered_coupling.hpp"
#include "common/net/clock_sync.hpp"
#include "common/net/text.hpp"
#include "common/realtime/mailbox.hpp"
#include "proto/datagram_channel.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Interface through which the session sends. After close(), the transport must not call the session about the closed
/// connection.
class ClientTransport {
 public:
  virtual ~ClientTransport() = default;
  /// Starts (or restarts) the TCP connection; on_connected() or on_disconnected() follows.
  virtual void connect(LocalTime now) = 0;
  virtual void send_control(std::span<const std::byte> bytes) = 0;
  /// Sends a datagram; returns false if it could not be sent now. Never queues it.
  virtual bool send_datagram(std::span<const std::byte> datagram) = 0;
  /// Keying material exported from the connection's TLS (RFC 8446 §7.5); none if the connection is not encrypted.
  virtual std::optional<secure::Exported> exported(std::string_view /*label*/, std::span<const std::byte> /*context*/) {
    return std::nullopt;
  }
  /// Sets the server's datagram port, as received in its Welcome message.
  virtual void set_datagram_port(std::uint16_t port) = 0;
  /// Number of control bytes that the connection has not accepted yet. With state over TCP, state is sent only when it
  /// is 0.
  virtual std::size_t queued_control_bytes() const = 0;
  /// Results so far for the addresses that connect() tries, as text for the user; empty if there is only one address.
  virtual std::string connecting_to() const { return {}; }
  /// Closes the connection. Queued bytes are sent before, as far as that does not block.
  virtual void close() = 0;
};

/// Receiver of the events and bytes of a ClientTransport.
class TransportListener {
 public:
  virtual void on_connected(LocalTime now) = 0;
  virtual void on_disconnected(LocalTime now, const std::string& why) = 0;
  virtual void on_control_bytes(std::span<const std::byte> bytes, LocalTime now) = 0;
  virtual void on_datagram(std::span<const std::byte> datagram, LocalTime now) = 0;

 protected:
  ~TransportListener() = default;
};

struct SessionSettings {
  std::string room = "";  ///< name of the room; "" for the server's only room
  std::string user_name = "user";
  wire::Role role = wire::ROLE_MANIPULATOR;
  proto::Bytes token{};  ///< one-time invitation token (proto/join_token.hpp); sent only over an encrypted connection
  bool state_over_tcp = false;  ///< sends state over TCP, for networks that block UDP
  Duration silence_timeout{std::chrono::milliseconds(1500)};
  Duration setup_timeout{std::chrono::seconds(5)};  ///< time-out of each step: connecting, greeting, joining
  /// If there is no new haptic update for this long, the last one is sent again without a handle.
  Duration keep_alive{std::chrono::milliseconds(50)};
  /// For this long, repeated updates contain the last buttons, then no buttons. Thus a held body is not released by a
  /// short stall of the haptic thread, but it is released if the haptic thread has failed.
  Duration buttons_kept{std::chrono::milliseconds(250)};
  Duration reconnect_delay{std::chrono::milliseconds(250)};  ///< first delay; doubled up to reconnect_delay_max
  Duration reconnect_delay_max{std::chrono::seconds(2)};
  bool may_reconnect = true;               ///< reconnects if the connection is lost after a join
  std::vector<std::string> asset_kinds{};  ///< kinds of assets to fetch (proto/WIRE.md); others are not fetched
  bool wants_soft_shapes = false;          ///< receives the shapes of soft bodies, for a window
  /// Kinds of assets that are used for drawing only. The smallest "drawing" of each surface is fetched before all
  /// asset_kinds, the other drawings after them.
  std::vector<std::string> drawn_asset_kinds{};
  bool fetches_one_at_a_time = false;  ///< requests one piece at a time; for comparison in the lab
  /// Store that is queried for assets before the server, and that keeps fetched assets. If it is null, fetched assets
  /// are discarded at the end of the session.
  std::shared_ptr<AssetStore> asset_store{};
  /// Weber fraction of the deadband (common/net/deadband.hpp), for both directions: smaller changes are not sent at
  /// once. If it is 0, all changes are sent.
  double deadband = 0;
  /// The user's scale and rotation of the scene's workspace mapping.
  WorkspaceSettings workspace{};
  bool has_nudges = true;  ///< nudges the hand towards a place that another user points at; false: only shows the place
  /// Upper bounds of the coupling for the user's device, in the device's newtons and metres. The server applies them to
  /// this user's tool, too.
  haptics::CouplingParameters coupling_bounds = haptics::kNoCouplingBounds;
  /// Device with which the scene's coupling is checked (CouplingWatch). If the coupling is unstable, no force is
  /// displayed, but the hand still drives its tool. Without a device there is no check.
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

class ClientSession final : public TransportListener {
 public:
  ClientSession(SessionSettings settings, ClientTransport& transport, ClientMailboxes& mailboxes);
  ~ClientSession();

  /// Replaces the token of the settings. Must be called before start().
  void set_credentials(const Credentials& credentials);
  void start(LocalTime now);
  void on_connected(LocalTime now) override;
  void on_disconnected(LocalTime now, const std::string& why) override;
  void on_control_bytes(std::span<const std::byte> bytes, LocalTime now) override;
  void on_datagram(std::span<const std::byte> datagram, LocalTime now) override;
  /// Sends a new haptic update if there is one, checks time-outs, and reconnects. Must be called after every haptic
  /// tick, and every few milliseconds if no ticks run.
  void poll(LocalTime now);

  /// Performs a command. A command that needs a request to the server is ignored unless the session is in a room.
  void send(const SessionCommand& command, LocalTime now);
  void leave(LocalTime now);
  /// Ends the session and the force because of an error in this program.
  void fail(const std::string& why);
  /// Selects the kinds of assets to fetch. From then on, asset_level() and on_assets refer to these kinds.
  void set_asset_kinds(std::vector<std::string> kinds);
  /// Availability of the assets; kNone outside a room.
  AssetLevel asset_level() const;

  const SessionStatus& status() const;
  /// Message of the last join, with the scene and this user's tool; null before the first join.
  const wire::Joined* joined() const;
  /// HapticScene::generation of the last join; 0 if there was none.
  std::uint32_t scene_generation() const;
  /// Coupling coefficients of this user's tool, as last received.
  const haptics::CouplingParameters& coupling() const;
  /// Coupling law of the room, as last received; the default law before the first join.
  const haptics::CouplingLawInfo& law() const;
  /// Last check of the current coupling; explained() gives its findings.
  const CouplingCheck& coupling_check() const;
  /// True if the session is in a room and has received a state since the last join.
  bool has_state() const;
  /// Name of the requested room. If no room was requested, the only room of the last Welcome message; "" before that.
  const std::string& room() const;
  /// Rooms in the last Welcome message.
  const std::vector<std::string>& rooms() const;
  /// Shapes of the scene's soft bodies, as last received: offsets of the nodes of proto::soft_lattice(). An entry is
  /// null if no shape of that body was received.
  const std::vector<std::shared_ptr<const std::vector<Vec3>>>& soft_offsets() const;
  /// True if places that other users point at nudge the hand.
  bool has_nudges() const;
  /// State and events of the room's game; null if it has none.
  const std::shared_ptr<const GameReport>& game() const;
  /// Last place that each user pointed at, with the time of reception. It is shown for kPointed.
  const std::vector<std::pair<LocalTime, wire::Pointed>>& pointed() const;
  static constexpr Duration kPointed = std::chrono::seconds(5);
  /// Checked poses of the room's two molecules, in ascending order of their numbers; null if none were received.
  const std::shared_ptr<const std::vector<wire::KeptPose>>& kept_poses() const;
  /// Start of this user's hand, in the scene of the last join.
  const HandStart& hand_start() const;
  /// Progress of the running minimisation in the room; none if no minimisation is running.
  const std::optional<wire::PoseProgress>& pose_progress() const;
  /// Credentials for a second device of the user; null if they are not needed or not available. The second device then
  /// joins as a separate user.
  std::shared_ptr<const Credentials> credentials_beside() const;
  /// Other users in the room.
  const std::vector<wire::UserJoined>& users() const;
  /// Verified bytes of the scene's assets by their SHA-256. Complete and partial assets remain stored after a
  /// reconnect. Assets are fetched in the background, at a rate that does not delay state
  /// (common/net/fetch_rate.hpp). The coarse replacements of large assets are fetched first (AssetInfo.coarse_of).
  const AssetMap& assets() const;
  net::ClockSync& clock_sync();
  const SessionCounters& counters() const;
  /// Called with each event. This callback and those below are called on the io thread, from inside the functions
  /// above. They must not call this session.
  std::function<void(const Event&)> on_event;
  /// Returns the reason why a valid scene cannot be displayed; empty if it can. If there is a reason, the session ends
  /// with a set-up error.
  std::function<std::string(const wire::Joined&)> find_scene_problem;
  /// Called when asset_level() has risen: once or twice for each join.
  std::function<void()> on_assets;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
