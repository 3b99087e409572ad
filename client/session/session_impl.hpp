// Private to this folder: the implementation of ClientSession. Its functions are defined in three source files:
//   session.cpp          connection: connecting, loss, time-outs, and state updates in both directions
//   session_control.cpp  handling of the server's control messages
//   session_commands.cpp commands of the user: requests to the server
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/session/credentials.hpp"
#include "client/session/joined_scene.hpp"
#include "client/session/pose_book.hpp"
#include "client/session/session.hpp"
#include "client/session/state_stream.hpp"
#include "proto/control_framing.hpp"

namespace tandem::client {

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
        assets({settings.asset_kinds, settings.drawn_asset_kinds, settings.fetches_one_at_a_time, settings.asset_store},
               [this](const std::string& line) { log(line); }) {}

  // Set-up and loss of the connection.
  void enter(SessionState state, LocalTime now);
  void connect(LocalTime now);
  void connected(LocalTime now);
  void lose(LocalTime now, const std::string& why, bool is_final = false);
  void end(const std::string& why, bool is_setup_error);
  void stop_state();
  void check_time_outs(LocalTime now);

  // Control messages.
  void receive_control_bytes(std::span<const std::byte> bytes, LocalTime now);
  void handle(const wire::ServerControl& message, LocalTime now);
  bool handle_active(const wire::ServerControl& message, LocalTime now);
  void receive_parameter(const wire::ParameterSet& parameter, LocalTime now);
  void receive_welcome(const wire::Welcome& welcome, LocalTime now);
  void receive_joined(const wire::Joined& joined, LocalTime now);
  void receive_error(const wire::ServerControl& message, LocalTime now);
  void receive_goodbye(const wire::Goodbye& goodbye, LocalTime now);
  void receive_soft_shape(const wire::SoftShape& message);
  void receive_start(const wire::RoomStart& start);
  void refuse_poses(const std::string& why);
  void receive_pointed(const wire::Pointed& message, LocalTime now);
  void come_back(const std::string& why, LocalTime now);
  void enter_room(const std::string& wanted, LocalTime now);
  void note_assets(bool has_risen);
  void request_assets(LocalTime now);
  void send(wire::ClientControl& message);
  void send_request(wire::ClientControl& message);

  // Commands of the user.
  void perform(const command::SetParameter& command, LocalTime now);
  void perform(const command::SetLaw& command, LocalTime now);
  void perform(const command::RequestPose& command, LocalTime now);
  void perform(const command::ChangeRoom& command, LocalTime now);
  void perform(const command::SetWorkspace& command, LocalTime now);
  void perform(const command::SetNudges& command, LocalTime now);
  /// Performs a command that only sends a request to the server.
  template <class Request>
  void perform(const Request& command, LocalTime /*now*/) {
    request([&](wire::ClientControl& message) { command.write(message); });
  }
  void set(const wire::SetParameter& parameter);
  /// Sends a request if the session is in a room, otherwise does nothing.
  template <class Fill>
  void request(const Fill& fill) {
    if (status.state != SessionState::kActive) return;
    wire::ClientControl message;
    fill(message);
    send_request(message);
  }

  // State updates.
  void send_newest(LocalTime now);
  bool deliver_state(std::span<const std::byte> datagram);

  void emit(const Event& event) const {
    if (owner.on_event) owner.on_event(event);
  }
  void log(const std::string& line) const { emit(event::Log{printable(line)}); }
  /// Reports a change in the room to the user, if the text is not empty.
  void report(const std::string& news) const {
    if (!news.empty()) emit(event::News{news});
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
  std::deque<std::uint32_t> settings_requested;  ///< numbers of the last kRemembered requests to change a parameter
  static constexpr std::size_t kRemembered = 64;

  std::string room;
  std::vector<std::string> rooms;
  std::optional<std::string> room_left;  // previous room; the session returns to it if the new room refuses the user
  std::vector<std::shared_ptr<const std::vector<Vec3>>> soft_offsets;
  AssetPlan assets;
  std::vector<wire::UserJoined> users;
  PoseBook poses;
  std::vector<std::pair<LocalTime, wire::Pointed>> pointed;

  ConnectionId connection;
  std::uint8_t epoch = 0;
  proto::Bytes frame_out;
};

}  // namespace tandem::client
