// The client's end of its connection to the server, without sockets and clock. The caller passes in the time and
// received bytes; the session sends bytes through a ClientTransport. A live client uses Asio (client/net), the lab uses
// simulated links.
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

/// Interface through which the session sends bytes. After close(), the transport must not call the session any more
/// about the closed connection.
class ClientTransport {
 public:
  virtual ~ClientTransport() = default;
  /// Starts (or restarts) the TCP connection. The transport then calls on_connected() or on_disconnected() of the
  /// session.
  virtual void connect(LocalTime now) = 0;
  virtual void send_control(std::span<const std::byte> bytes) = 0;
  /// Sends a datagram, without queueing it. Returns false if it could not be sent now.
  virtual bool send_datagram(std::span<const std::byte> datagram) = 0;
  /// Returns key material exported from the TLS connection (RFC 8446 §7.5); nothing if the connection is not encrypted.
  virtual std::optional<secure::Exported> exported(std::string_view /*label*/, std::span<const std::byte> /*context*/) {
    return std::nullopt;
  }
  /// Sets the server's port for datagrams, as received in its Welcome message.
  virtual void set_datagram_port(std::uint16_t port) = 0;
  /// Returns the number of control bytes that the connection has not accepted yet. State over TCP is sent only when
  /// this number is 0.
  virtual std::size_t queued_control_bytes() const = 0;
  /// Returns the results so far of connecting to the server's addresses, as text for the user. Empty if the server has
  /// only one address.
  virtual std::string connecting_to() const { return {}; }
  /// Closes the connection. Queued bytes are sent first, as far as that does not block.
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
  std::string room = "";  ///< name of the room; "": the only room of the server
  std::string user_name = "user";
  wire::Role role = wire::ROLE_MANIPULATOR;
  proto::Bytes token{};  ///< one-time invitation token (proto/join_token.hpp); sent only over an encrypted connection
  bool state_over_tcp = false;  ///< true: sends state over TCP, for networks that block UDP
  Duration silence_timeout{std::chrono::milliseconds(1500)};
  /// Maximum duration of each step of the set-up: connecting, greeting, joining
  Duration setup_timeout{std::chrono::seconds(5)};
  /// Time without a new client update from the haptic thread after which the last update is sent again, with its handle
  /// marked invalid.
  Duration keep_alive{std::chrono::milliseconds(50)};
  /// Time for which repeated updates contain the last buttons. After this time, they contain no pressed button. So a
  /// short stall of the haptic thread does not release a held body, but a failure of the haptic thread does.
  Duration buttons_kept{std::chrono::milliseconds(250)};
  /// Delay before the first attempt to reconnect; doubled after each attempt up to reconnect_delay_max
  Duration reconnect_delay{std::chrono::milliseconds(250)};
  Duration reconnect_delay_max{std::chrono::seconds(2)};
  bool may_reconnect = true;               ///< whether to reconnect if the connection is lost after a join
  std::vector<std::string> asset_kinds{};  ///< kinds of assets to fetch (proto/WIRE.md); others are not fetched
  bool wants_soft_shapes = false;          ///< whether to receive the shapes of soft bodies, for a window
  /// Kinds of assets that are used only for drawing. Of each surface, the smallest asset of the kind "drawing" is
  /// fetched first, before the asset_kinds. The remaining drawings are fetched after the asset_kinds.
  std::vector<std::string> drawn_asset_kinds{};
  /// True: a piece is requested only after the answer to the previous one; for comparisons in the lab
  bool fetches_one_at_a_time = false;
  /// Local store of assets. It is queried before the server, and receives each fetched asset. Null: fetched assets are
  /// discarded at the end of the session.
  std::shared_ptr<AssetStore> asset_store{};
  /// Weber fraction of the deadband (common/net/deadband.hpp), in both directions. Smaller relative changes of the
  /// state are not sent at once. 0: all changes are sent.
  double deadband = 0;
  /// Scale and rotation that the user adds to the scene's workspace mapping.
  WorkspaceSettings workspace{};
  /// True: the hand is nudged towards a position that another user points at; false: the position is only shown
  bool has_nudges = true;
  /// Upper bounds of the coupling for the user's device, in the device's newtons and metres. The server applies the
  /// same bounds to this user's tool.
  haptics::CouplingParameters coupling_bounds = haptics::kNoCouplingBounds;
  /// Device on which the scene's coupling must be stable (CouplingWatch). If the coupling is unstable, no force is
  /// displayed, but the hand still drives its tool. Empty: the coupling is not checked.
  std::optional<devices::DeviceProfile> device{};
};

struct SessionCounters : proto::ChannelCounters {
  std::uint64_t bytes_sent = 0;
  std::uint64_t bytes_received = 0;
  std::uint64_t reconnects = 0;
  std::uint64_t refused_settings = 0;  ///< number of refused requests to change a parameter or the law
};

using net::printable;

class Credentials;

class ClientSession final : public TransportListener {
 public:
  ClientSession(SessionSettings settings, ClientTransport& transport, ClientMailboxes& mailboxes);
  ~ClientSession();

  /// Replaces the token in the settings. Must be called before start().
  void set_credentials(const Credentials& credentials);
  void start(LocalTime now);
  void on_connected(LocalTime now) override;
  void on_disconnected(LocalTime now, const std::string& why) override;
  void on_control_bytes(std::span<const std::byte> bytes, LocalTime now) override;
  void on_datagram(std::span<const std::byte> datagram, LocalTime now) override;
  /// Sends a new client update if there is one, checks time-outs, and reconnects. Must be called after every haptic
  /// tick, and every few milliseconds if no ticks run.
  void poll(LocalTime now);

  /// Performs a command. Commands that need a request to the server are ignored unless the session is in a room.
  void send(const SessionCommand& command, LocalTime now);
  void leave(LocalTime now);
  /// Ends the session because of an error in this program. After this call, the scene's force is no longer displayed.
  void fail(const std::string& why);
  /// Selects the kinds of assets to fetch. From this call on, asset_level() and on_assets refer to these kinds.
  void set_asset_kinds(std::vector<std::string> kinds);
  /// Returns the availability of the assets; kNone outside a room.
  AssetLevel asset_level() const;

  const SessionStatus& status() const;
  /// Returns the message of the last join, with the scene and this user's tool; null before the first join.
  const wire::Joined* joined() const;
  /// Returns HapticScene::generation of the last join; 0 before the first join.
  std::uint32_t scene_generation() const;
  /// Returns the coupling coefficients of this user's tool, as last received.
  const haptics::CouplingParameters& coupling() const;
  /// Returns the coupling law of the room, as last received; the default law before the first join.
  const haptics::CouplingLawInfo& law() const;
  /// Returns the last check of the current coupling; explained() gives its findings.
  const CouplingCheck& coupling_check() const;
  /// Returns true if the session is in a room and has received a state update since the last join.
  bool has_state() const;
  /// Returns the name of the requested room. If no room was requested, returns the only room of the last Welcome
  /// message, or "" before this message.
  const std::string& room() const;
  /// Returns the rooms in the last Welcome message.
  const std::vector<std::string>& rooms() const;
  /// Returns the shapes of the scene's soft bodies, as last received: for each body, the offsets of its nodes from
  /// proto::soft_lattice(). Null for a body whose shape has not been received.
  const std::vector<std::shared_ptr<const std::vector<Vec3>>>& soft_offsets() const;
  /// Returns true if a position that another user points at nudges the hand.
  bool has_nudges() const;
  /// Returns state and events of the room's game; null if the room has no game.
  const std::shared_ptr<const GameReport>& game() const;
  /// Returns the last position that each user pointed at, with the time of reception. A position is shown for kPointed.
  const std::vector<std::pair<LocalTime, wire::Pointed>>& pointed() const;
  static constexpr Duration kPointed = std::chrono::seconds(5);
  /// Returns the validated poses of the room's two molecules, in ascending order of their numbers; null if none were
  /// received.
  const std::shared_ptr<const std::vector<wire::KeptPose>>& kept_poses() const;
  /// Returns the time at which this user's simulated or recorded hand starts, in the scene of the last join.
  const HandStart& hand_start() const;
  /// Returns the progress of the running energy minimisation in the room; empty if none is running.
  const std::optional<wire::PoseProgress>& pose_progress() const;
  /// Returns credentials for a second device of the user, which joins as a separate user. Null if they are not needed
  /// or not available.
  std::shared_ptr<const Credentials> credentials_beside() const;
  /// Returns the other users in the room.
  const std::vector<wire::UserJoined>& users() const;
  /// Returns the verified bytes of the scene's assets, indexed by their SHA-256. Assets are fetched in the background,
  /// at a rate that does not delay state updates (common/net/fetch_rate.hpp). Coarse replacements of large assets are
  /// fetched first (AssetInfo.coarse_of). After a reconnect, all received assets are kept, even if they are not
  /// complete.
  const AssetMap& assets() const;
  net::ClockSync& clock_sync();
  const SessionCounters& counters() const;
  /// Called with each event. This callback and the two below are called on the io thread from inside the functions
  /// above. They must not call functions of this session.
  std::function<void(const Event&)> on_event;
  /// Returns the reason why a valid scene cannot be displayed, or an empty text if it can. With a reason, the session
  /// ends with a set-up error.
  std::function<std::string(const wire::Joined&)> find_scene_problem;
  /// Called when asset_level() has risen, which happens once or twice for each join.
  std::function<void()> on_assets;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
