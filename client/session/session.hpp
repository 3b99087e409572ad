// The client's side of its connection, without a socket: bytes and time come in, bytes go out through
// ClientTransport. Live it is driven by Asio (client/net), in the lab by simulated links.
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

#include "client/haptics/coupling_check.hpp"
#include "client/haptics/hand_workspace.hpp"
#include "client/haptics/mailboxes.hpp"
#include "client/session/asset_fetcher.hpp"
#include "common/base/time.hpp"
#include "common/haptics/coupling/rendered_coupling.hpp"
#include "common/net/clock_sync.hpp"
#include "common/net/text.hpp"
#include "common/realtime/mailbox.hpp"
#include "proto/datagram_channel.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// How the session sends. After close(), nothing of the closed connection may be reported any more.
class ClientTransport {
 public:
  virtual ~ClientTransport() = default;
  /// Starts (or restarts) the TCP connection; on_connected() or on_disconnected() follows.
  virtual void connect(LocalTime now) = 0;
  virtual void send_control(std::span<const std::byte> bytes) = 0;
  /// Freshest-only; false when it could not be sent now.
  virtual bool send_datagram(std::span<const std::byte> datagram) = 0;
  /// What the connection's TLS exports (RFC 8446 §7.5); nothing where it is not encrypted.
  virtual std::optional<secure::Exported> exported(std::string_view /*label*/, std::span<const std::byte> /*context*/) {
    return std::nullopt;
  }
  /// Where datagrams go, from the server's Welcome.
  virtual void set_datagram_port(std::uint16_t port) = 0;
  /// Control bytes that the connection has not taken yet; over TCP, state is sent only when it is 0.
  virtual std::size_t queued_control_bytes() const = 0;
  /// Results so far of the addresses that connect() tries, for people; empty: there is only one.
  virtual std::string connecting_to() const { return {}; }
  /// Closes after what is queued has been sent, as far as that does not block.
  virtual void close() = 0;
};

struct SessionSettings {
  std::string room = "";  ///< "": the server's only room
  std::string user_name = "user";
  wire::Role role = wire::ROLE_MANIPULATOR;
  proto::Bytes token{};         ///< that lets in, once (proto/join_token.hpp); only sent where it is encrypted
  bool state_over_tcp = false;  ///< where UDP does not pass
  Duration silence_timeout{std::chrono::milliseconds(1500)};
  Duration setup_timeout{std::chrono::seconds(5)};  ///< for each of connecting, greeting and joining
  Duration keep_alive{
      std::chrono::milliseconds(50)};  ///< with no haptic update for this long, the last is repeated, without a handle
  /// A repeated update keeps the buttons for this long: a stall drops nothing, a dead haptic thread holds nothing.
  Duration buttons_kept{std::chrono::milliseconds(250)};
  Duration reconnect_delay{std::chrono::milliseconds(250)};  ///< first; doubled up to reconnect_delay_max
  Duration reconnect_delay_max{std::chrono::seconds(2)};
  bool may_reconnect = true;               ///< after a connection that once joined was lost
  std::vector<std::string> asset_kinds{};  ///< that are fetched, of proto/WIRE.md's; others stay at the server
  bool wants_soft_shapes = false;          ///< is told how soft bodies yield: for a window
  /// Likewise, of what is only drawn: the smallest "drawing" of each surface before all those, the rest once they are here.
  std::vector<std::string> drawn_asset_kinds{};
  bool fetches_one_at_a_time = false;  ///< a piece is asked for when the one before is here: the lab's comparison
  /// Asked for assets before the server is, and told what came from it; null: what is fetched lives as long as
  /// the session.
  std::shared_ptr<AssetStore> asset_store{};
  /// Weber fraction (common/net/deadband.hpp): what differs by less is not sent at once, in either direction; 0: all
  /// is.
  double deadband = 0;
  /// What the user changes of the scene's workspace mapping.
  WorkspaceSettings workspace{};
  bool has_nudges = true;  ///< a place that another user points at is felt, too; false: only seen
  /// Of the coupling, that the user's device bears, in its newtons and metres: the tool at the server is pulled no harder.
  haptics::CouplingParameters coupling_bounds = haptics::kNoCouplingBounds;
  /// What the scene's coupling is checked with (CouplingWatch): one that is unstable on it is not displayed, and the
  /// hand still drives its tool. None: no check.
  std::optional<devices::DeviceProfile> device{};
};

enum class SessionState { kConnecting, kGreeting, kJoining, kActive, kWaiting, kEnded };
std::string_view name_of(SessionState state);

/// What is here of the assets of the joined scene that are wanted, or cannot be had. kCoarse: of each itself, or what stands
/// for it.
enum class AssetLevel : std::uint8_t { kNone, kCoarse, kFull };

struct SessionCounters : proto::ChannelCounters {
  std::uint64_t bytes_sent = 0;
  std::uint64_t bytes_received = 0;
  std::uint64_t reconnects = 0;
  std::uint64_t refused_settings = 0;  ///< parameters and laws that the server refused to set
};

/// Why the session is not active, for people: the last error, goodbye or lost connection; empty when all is well.
struct SessionStatus {
  SessionState state = SessionState::kConnecting;
  std::string why;
  /// Set in kEnded: the set-up is wrong (version, room, name) and trying again would not help.
  bool is_setup_error = false;
};

using net::printable;

class Credentials;

/// Receives the answer to one request about poses, once, on the io thread: the message of the server that carries the
/// request's number, or an error when the connection ended before it came.
/// In      minimising  last progress of this user's own minimisations
using PoseReply = std::function<void(const wire::ServerControl& answer, const wire::PoseProgress& minimising)>;

class ClientSession {
 public:
  ClientSession(SessionSettings settings, ClientTransport& transport, ClientMailboxes& mailboxes);
  ~ClientSession();

  /// Before start(): instead of the settings' token.
  void set_credentials(const Credentials& credentials);
  void start(LocalTime now);
  void on_connected(LocalTime now);
  void on_disconnected(LocalTime now, const std::string& why);
  void on_control_bytes(std::span<const std::byte> bytes, LocalTime now);
  void on_datagram(std::span<const std::byte> datagram, LocalTime now);
  /// Sends the newest haptic update if there is one; keeps time-outs and reconnection. After every haptic tick, and
  /// every few milliseconds without.
  void poll(LocalTime now);

  void grab(BodyId body);
  void release();
  void set_parameter(const std::string& name, double value);
  /// As the room's operator: its coupling law, until he leaves.
  void set_law(const std::string& law);
  /// As the operator: that user's session ends, and it takes a new invitation to come back.
  void kick(UserId user);
  /// Back to the start, all that moves; for the room's operator.
  void reset_room();
  /// Keeps a pose of the room's two molecules, goes to another one, deletes or renames one, minimises, or cancels that.
  /// In      on_answer  may be empty; must not call this session
  void ask_pose(const wire::AskPose& asked, PoseReply on_answer = {});
  /// Shows the others a place.
  void point(const wire::Point& place);
  /// Leaves this room for another of the same server; when that refuses, comes back.
  void change_room(const std::string& room, LocalTime now);
  /// Now and for the scenes to come. The force goes, the tool stays where it is, and the force comes back by the ramp.
  void set_workspace(const WorkspaceSettings& workspace);
  /// Places that others point at nudge the hand from now on, or are only seen.
  void set_nudges(bool has_nudges);
  bool has_nudges() const;
  void leave(LocalTime now);
  /// Ends the session for a fault of this program: the force goes.
  void fail(const std::string& why);
  /// Fetches assets of these kinds instead from now on; asset_level() and on_assets say what of them is here.
  void set_asset_kinds(std::vector<std::string> kinds);
  /// kNone where not in a room.
  AssetLevel asset_level() const;

  const SessionStatus& status() const;
  /// The scene and this user's place in it, from the last Joined; null before the first.
  const wire::Joined* joined() const;
  /// HapticScene::generation of the last join; 0: none.
  std::uint32_t scene_generation() const;
  /// Of the own tool, as the server told last.
  const haptics::CouplingParameters& coupling() const;
  /// Of the room, likewise; before the first join the default.
  const haptics::CouplingLawInfo& law() const;
  /// The last check of the coupling in force; explained() says what it found.
  const CouplingCheck& coupling_check() const;
  /// In a room, and a state has come since the last join.
  bool has_state() const;
  /// The room that was asked for or, without a wish, the only one of the last Welcome; "" before that.
  const std::string& room() const;
  /// Of the last Welcome.
  const std::vector<std::string>& rooms() const;
  /// How the scene's soft bodies yield, as told last: offsets of proto::soft_lattice(). Null: not told.
  const std::vector<std::shared_ptr<const std::vector<Vec3>>>& soft_offsets() const;
  /// What users point at, and since when: the last place of each, for kPointed.
  const std::vector<std::pair<LocalTime, wire::Pointed>>& pointed() const;
  static constexpr Duration kPointed = std::chrono::seconds(5);
  /// Of the room's two molecules, sound, by their numbers; null: none was told.
  const std::shared_ptr<const std::vector<wire::KeptPose>>& kept_poses() const;
  /// When the hand of this user begins, in the scene of the last join.
  const HandStart& hand_start() const;
  /// Of the minimisation that is under way in the room; none: none is.
  const std::optional<wire::PoseProgress>& pose_progress() const;
  /// What the server refused last, or the last news of the room, for people; "" before the first.
  const std::string& news() const;
  /// That let in a second device of the user; null: without them it joins as anybody does.
  std::shared_ptr<const Credentials> credentials_beside() const;
  /// The others who are in the room.
  const std::vector<wire::UserJoined>& users() const;
  /// Verified bytes of the scene's files by their SHA-256; kept across reconnects, as is what has come of one that is not
  /// whole yet. Fetched in the background, no faster than leaves room for state (common/net/fetch_rate.hpp); of large ones
  /// what stands for them first (AssetInfo.coarse_of).
  const AssetMap& assets() const;
  net::ClockSync& clock_sync();
  const SessionCounters& counters() const;
  /// Called on the io thread.
  std::function<void(const wire::Joined&)> on_joined;
  /// Empty, or why a scene whose numbers are sound cannot be shown: the session then ends, as for a bad set-up.
  std::function<std::string(const wire::Joined&)> find_scene_problem;
  /// asset_level() has risen: once or twice a join.
  std::function<void()> on_assets;
  std::function<void(const std::string&)> on_log;
  std::function<void(const wire::ParameterSet&)> on_parameter;
  /// A grab, release or parameter that the server refused.
  std::function<void(const wire::Error&)> on_refused;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
