// Private to this folder: implementation of ClientSession and the tasks of its sources.
//   session.cpp          the connection: connect, lose, time-outs, state in both directions
//   session_assets.cpp   selection and order of the assets to look up and fetch
//   session_control.cpp  the server's control messages and the requests to it
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/session/credentials.hpp"
#include "client/session/joined_scene.hpp"
#include "client/session/session.hpp"
#include "client/session/state_stream.hpp"
#include "common/net/fetch_rate.hpp"
#include "proto/control_framing.hpp"

namespace tandem::client {

/// Next step of fetching a scene's assets, taken when the store has answered all look-ups.
enum class FetchStep : std::uint8_t {
  kNone,     ///< nothing
  kSelect,   ///< tactile assets were looked up; next, look up coarse replacements of missing ones
  kFetch,    ///< replacements and first drawings were looked up; next, fetch from the server
  kDrawings  ///< remaining drawings were looked up; next, fetch them
};

struct ClientSession::Impl {
  Impl(ClientSession& session, SessionSettings session_settings, ClientTransport& session_transport,
       ClientMailboxes& session_mailboxes)
      : owner(session),
        settings(std::move(session_settings)),
        transport(session_transport),
        scene(settings.device, session_mailboxes, [this](const std::string& line) { log(line); }),
        stream(settings, session_mailboxes, counters),
        credentials(std::exchange(settings.token, {})),
        retry_delay(settings.reconnect_delay),
        assets(kMaxAssetBytes, settings.asset_store) {}

  // Connecting and losing
  void enter(SessionState state, LocalTime now);
  void connect(LocalTime now);
  void connected(LocalTime now);
  void lose(LocalTime now, const std::string& why, bool is_final = false);
  void end(const std::string& why, bool is_setup_error);
  void stop_state();
  void check_time_outs(LocalTime now);

  // Control
  void receive_control_bytes(std::span<const std::byte> bytes, LocalTime now);
  void handle(const wire::ServerControl& message, LocalTime now);
  bool handle_active(const wire::ServerControl& message, LocalTime now);
  void receive_parameter(const wire::ParameterSet& parameter, LocalTime now);
  void receive_welcome(const wire::Welcome& welcome, LocalTime now);
  void receive_joined(const wire::Joined& joined, LocalTime now);
  void receive_error(const wire::ServerControl& message, LocalTime now);
  void receive_goodbye(const wire::Goodbye& goodbye, LocalTime now);
  void receive_asset_chunk(const wire::ServerControl& message, LocalTime now);
  void receive_soft_shape(const wire::SoftShape& message);
  void receive_kept_pose(const wire::KeptPose& message);
  void receive_start(const wire::RoomStart& start);
  void receive_pose_deleted(const wire::PoseDeleted& message);
  void receive_pose_progress(const wire::PoseProgress& message);
  void answer_pose(const wire::ServerControl& message);
  void refuse_poses(const std::string& why);
  void receive_pointed(const wire::Pointed& message, LocalTime now);
  void come_back(const std::string& why, LocalTime now);
  void enter_room(const std::string& wanted, LocalTime now);
  void fetch(bool is_connected_anew);
  void plan_fetch();
  void fetch_drawn();
  AssetInfos drawings_by_size() const;
  void continue_fetching();
  bool is_planning() const { return fetch_step == FetchStep::kSelect || fetch_step == FetchStep::kFetch; }
  void request_assets(LocalTime now);
  void announce_assets();
  void send(wire::ClientControl& message);
  void send_request(wire::ClientControl& message);
  void remember_setting();
  /// Sends a request if the session is active, else does nothing.
  template <class Fill>
  void request(const Fill& fill) {
    if (status.state != SessionState::kActive) return;
    wire::ClientControl message;
    fill(message);
    send_request(message);
  }

  // State
  void send_newest(LocalTime now);
  bool deliver_state(std::span<const std::byte> datagram);

  void log(const std::string& line) const {
    if (owner.on_log) owner.on_log(printable(line));
  }

  ClientSession& owner;
  SessionSettings settings;
  ClientTransport& transport;
  SessionCounters counters;
  JoinedScene scene;
  StateStream stream;

  SessionStatus status;
  LocalTime entered{};  // time of the last change of state
  bool has_joined = false;
  Credentials credentials;
  Duration retry_delay;
  proto::FrameReader reader;
  std::uint32_t last_request = 0;
  std::deque<std::uint32_t> settings_requested;  ///< numbers of the last kRemembered requests to set something
  static constexpr std::size_t kRemembered = 64;

  std::string room;
  std::vector<std::string> rooms;
  std::optional<std::string> room_left;  // returned to if the next room refuses
  std::vector<std::shared_ptr<const std::vector<Vec3>>> soft_offsets;
  std::string news;
  AssetFetcher assets;
  net::FetchRate fetch_rate;
  AssetLevel asset_level = AssetLevel::kNone;  // level for this join and its asset kinds
  FetchStep fetch_step = FetchStep::kNone;
  AssetInfos felt_coarse;  // the tactile assets or their coarse replacements
  AssetInfos felt_fine;    // full assets that follow the replacements
  std::vector<wire::UserJoined> users;
  std::shared_ptr<const std::vector<wire::KeptPose>> kept_poses;
  std::optional<wire::PoseProgress> pose_progress;
  wire::PoseProgress own_progress;                   // last progress of this user's minimisations
  std::map<std::uint32_t, PoseReply> pose_requests;  // open requests by number
  std::vector<std::pair<LocalTime, wire::Pointed>> pointed;

  ConnectionId connection;
  std::uint8_t epoch = 0;
  proto::Bytes frame_out;
};

}  // namespace tandem::client
