#include "client/session/session.hpp"

#include <algorithm>
#include <array>

#include "client/session/joined_scene.hpp"
#include "client/session/state_stream.hpp"
#include "proto/control_framing.hpp"
#include "proto/coupling_fields.hpp"

namespace tandem::client {
namespace {

constexpr const char* kProgram = "tandem-client";

std::string milliseconds(Duration duration) {
  return std::to_string(duration / std::chrono::milliseconds(1)) + " ms";
}

google::protobuf::RepeatedPtrField<wire::AssetInfo> of_kinds(
    const std::vector<std::string>& kinds, const google::protobuf::RepeatedPtrField<wire::AssetInfo>& offered) {
  google::protobuf::RepeatedPtrField<wire::AssetInfo> wanted;
  for (const wire::AssetInfo& info : offered) {
    if (std::ranges::find(kinds, info.kind()) != kinds.end()) *wanted.Add() = info;
  }
  return wanted;
}

/// True for refusals that time can cure: our own old connection may still hold the place.
bool may_pass(wire::ErrorCode code) {
  return code == wire::ERROR_ROOM_FULL || code == wire::ERROR_SERVER_FULL;
}

}  // namespace

std::string printable(std::string text) {
  constexpr std::size_t kMaxTextBytes = 400;
  if (text.size() > kMaxTextBytes) text.resize(kMaxTextBytes);
  for (char& character : text) {
    const auto byte = static_cast<unsigned char>(character);
    if (byte < 0x20 || byte == 0x7F) character = '?';
  }
  return text;
}

std::string_view name_of(SessionState state) {
  constexpr std::array<std::string_view, 6> kNames{"connecting", "greeting", "joining", "active", "waiting", "ended"};
  return kNames.at(static_cast<std::size_t>(state));
}

struct ClientSession::Impl {
  Impl(ClientSession& session, SessionSettings session_settings, ClientTransport& session_transport,
       ClientMailboxes& session_mailboxes)
      : owner(session),
        settings(std::move(session_settings)),
        transport(session_transport),
        scene(settings.device, session_mailboxes, [this](const std::string& line) { log(line); }),
        stream(settings, session_mailboxes, counters),
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
  void take_control_bytes(std::span<const std::byte> bytes, LocalTime now);
  void handle(const wire::ServerControl& message, LocalTime now);
  bool handle_active(const wire::ServerControl& message, LocalTime now);
  void take_welcome(const wire::Welcome& welcome, LocalTime now);
  void take_joined(const wire::Joined& joined, LocalTime now);
  void take_error(const wire::ServerControl& message, LocalTime now);
  void take_goodbye(const wire::Goodbye& goodbye, LocalTime now);
  void take_asset_chunk(const wire::AssetChunk& chunk);
  void fetch(const std::vector<std::string>& kinds);
  void request_asset();
  void announce_assets();
  void send(wire::ClientControl& message);
  void send_request(wire::ClientControl& message);

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
  LocalTime entered{};  // the present state
  bool has_joined = false;
  Duration retry_delay;
  proto::FrameReader reader;
  std::uint32_t last_request = 0;
  std::uint32_t asset_request = 0;  // 0: none awaited

  std::string room;
  AssetFetcher assets;
  bool has_announced_assets = false;  // of this join
  std::vector<wire::UserJoined> users;

  ConnectionId connection;
  std::uint8_t epoch = 0;
  proto::Bytes frame_out;
};

void ClientSession::Impl::enter(SessionState state, LocalTime now) {
  status.state = state;
  entered = now;
}

void ClientSession::Impl::connect(LocalTime now) {
  enter(SessionState::kConnecting, now);
  reader = proto::FrameReader();
  transport.connect(now);
}

void ClientSession::Impl::connected(LocalTime now) {
  if (status.state != SessionState::kConnecting) return;
  enter(SessionState::kGreeting, now);
  wire::ClientControl message;
  wire::Hello& hello = *message.mutable_hello();
  hello.set_protocol_version(proto::kProtocolVersion);
  hello.set_program(kProgram);
  hello.add_capabilities(settings.state_over_tcp ? proto::kCapabilityStateTcp : proto::kCapabilityStateUdp);
  send_request(message);
}

void ClientSession::Impl::lose(LocalTime now, const std::string& why, bool is_final) {
  if (status.state == SessionState::kEnded || status.state == SessionState::kWaiting) return;
  if (is_final || !has_joined) {
    end(why, true);
  } else if (!settings.may_reconnect) {
    end(why, false);
  } else {
    stop_state();
    transport.close();
    enter(SessionState::kWaiting, now);
    status.why = printable(why);
    log(why + "; trying again in " + milliseconds(retry_delay));
  }
}

void ClientSession::Impl::end(const std::string& why, bool is_setup_error) {
  stop_state();
  transport.close();
  status = {SessionState::kEnded, printable(why), is_setup_error};
  // A set-up error is the program's last word; it prints `why` itself.
  if (!is_setup_error) log(why);
}

void ClientSession::Impl::stop_state() {
  stream.end();
  scene.hide();
}

void ClientSession::Impl::check_time_outs(LocalTime now) {
  switch (status.state) {
    case SessionState::kConnecting:
    case SessionState::kGreeting:
    case SessionState::kJoining:
      if (now - entered < settings.setup_timeout) return;
      lose(now, "the server did not answer within " + milliseconds(settings.setup_timeout) + " (" +
                    std::string(name_of(status.state)) + ")");
      return;
    case SessionState::kActive:
      if (now - stream.last_heard() < settings.silence_timeout) return;
      if (stream.has_heard()) {
        lose(now, "nothing came from the server for " + milliseconds(settings.silence_timeout));
      } else {
        lose(now,
             "joined, but no state arrived within " + milliseconds(settings.silence_timeout) +
                 (settings.state_over_tcp ? "" : "; is UDP blocked? state can go over TCP instead (--transport tcp)"));
      }
      return;
    case SessionState::kWaiting:
      if (now - entered < retry_delay) return;
      retry_delay = std::min(2 * retry_delay, settings.reconnect_delay_max);
      connect(now);
      return;
    case SessionState::kEnded:
      return;
  }
}

void ClientSession::Impl::take_control_bytes(std::span<const std::byte> bytes, LocalTime now) {
  if (status.state == SessionState::kEnded || status.state == SessionState::kWaiting) return;
  counters.bytes_received += bytes.size();
  if (!reader.feed(bytes)) {
    lose(now, "protocol error: the server announced a control message that is too long");
    return;
  }
  wire::ServerControl message;
  while (status.state != SessionState::kEnded && status.state != SessionState::kWaiting) {
    const auto payload = reader.next();
    if (!payload) return;
    if (!proto::parse_control(*payload, message)) {
      lose(now, "protocol error: a control message of the server could not be read");
      return;
    }
    handle(message, now);
  }
}

void ClientSession::Impl::handle(const wire::ServerControl& message, LocalTime now) {
  if (message.has_welcome() && status.state == SessionState::kGreeting) {
    take_welcome(message.welcome(), now);
  } else if (message.has_joined() && status.state == SessionState::kJoining) {
    take_joined(message.joined(), now);
  } else if (message.has_goodbye()) {
    take_goodbye(message.goodbye(), now);
  } else if (message.has_error()) {
    take_error(message, now);
  } else if (!handle_active(message, now)) {
    lose(now, "protocol error: the server sent a message that is not allowed in state " +
                  std::string(name_of(status.state)));
  }
}

bool ClientSession::Impl::handle_active(const wire::ServerControl& message, LocalTime now) {
  if (status.state != SessionState::kActive) return false;
  switch (message.message_case()) {
    case wire::ServerControl::kGrabbed:
      scene.hold(BodyId{message.grabbed().body()}, now);
      log("grabbed body " + std::to_string(message.grabbed().body()));
      return true;
    case wire::ServerControl::kReleased:
      scene.hold(BodyId{}, now);
      log("released body " + std::to_string(message.released().body()));
      return true;
    case wire::ServerControl::kUserJoined:
      scene.meet(message.user_joined());
      if (users.size() < proto::kMaxUsers) users.push_back(message.user_joined());
      log("user " + std::to_string(message.user_joined().user()) + " \"" + message.user_joined().name() + "\" is here");
      return true;
    case wire::ServerControl::kUserLeft:
      std::erase_if(users, [&message](const auto& user) { return user.user() == message.user_left().user(); });
      log("user " + std::to_string(message.user_left().user()) + " left");
      return true;
    case wire::ServerControl::kBodyReturned:
      log(scene.name_of(BodyId{message.body_returned().body()}) + " left the scene and is back at its start");
      return true;
    case wire::ServerControl::kAssetChunk:
      take_asset_chunk(message.asset_chunk());
      return true;
    case wire::ServerControl::kParameterSet:
      if (scene.set_parameter(message.parameter_set(), now) && owner.on_parameter) {
        owner.on_parameter(message.parameter_set());
      }
      return true;
    case wire::ServerControl::kStateDatagram:
      owner.on_datagram(std::as_bytes(std::span(message.state_datagram())), now);
      return true;
    case wire::ServerControl::kPong:
      return true;
    default:
      return false;
  }
}

void ClientSession::Impl::take_welcome(const wire::Welcome& welcome, LocalTime now) {
  if (welcome.protocol_version() != proto::kProtocolVersion) {
    lose(now,
         "the server speaks protocol version " + std::to_string(welcome.protocol_version()) + ", this client " +
             std::to_string(proto::kProtocolVersion) + "; use programs of the same version",
         true);
    return;
  }
  if (welcome.connection_id() == 0 || welcome.epoch() > 7 || welcome.datagram_port() > 65535) {
    lose(now, "protocol error: the server's welcome has a field out of range");
    return;
  }
  connection = ConnectionId{welcome.connection_id()};
  epoch = static_cast<std::uint8_t>(welcome.epoch());
  room = settings.room;
  if (room.empty() && welcome.rooms_size() == 1) room = printable(welcome.rooms(0));
  transport.set_datagram_port(static_cast<std::uint16_t>(welcome.datagram_port()));
  enter(SessionState::kJoining, now);
  wire::ClientControl message;
  message.mutable_join()->set_room(settings.room);
  message.mutable_join()->set_user_name(settings.user_name);
  message.mutable_join()->set_role(settings.role);
  message.mutable_join()->set_deadband(settings.deadband);
  proto::write_bounds(settings.coupling_bounds, *message.mutable_join()->mutable_coupling_bounds());
  send_request(message);
}

void ClientSession::Impl::take_joined(const wire::Joined& answer, LocalTime now) {
  std::string problem = scene.take(answer, settings.role, now);
  if (problem.empty() && settings.find_scene_problem) problem = settings.find_scene_problem(answer);
  if (!problem.empty()) {
    wire::ClientControl message;
    message.mutable_leave();
    send(message);
    lose(now, "the server's scene cannot be used: " + problem, true);
    return;
  }
  if (has_joined) ++counters.reconnects;
  has_joined = true;
  stream.begin(connection, epoch, now);
  retry_delay = settings.reconnect_delay;
  enter(SessionState::kActive, now);
  status.why.clear();
  scene.publish();
  const wire::Joined& joined = *scene.joined();
  log("joined \"" + joined.scene().name() + "\" as user " + std::to_string(joined.user()));
  if (owner.on_joined) owner.on_joined(joined);
  has_announced_assets = false;
  users.clear();
  fetch(settings.asset_kinds);
}

void ClientSession::Impl::take_error(const wire::ServerControl& message, LocalTime now) {
  const wire::Error& error = message.error();
  if (status.state != SessionState::kActive) {
    lose(now, "the server refused: " + error.text(), !(has_joined && may_pass(error.code())));
    return;
  }
  if (asset_request != 0 && message.request() == asset_request) {
    assets.on_refused();
    request_asset();
  }
  log("refused: " + error.text());
  if (owner.on_refused) owner.on_refused(error);
}

void ClientSession::Impl::take_goodbye(const wire::Goodbye& goodbye, LocalTime now) {
  lose(now, "the server ended the connection: " + goodbye.text(), goodbye.reason() == wire::DISCONNECT_WRONG_VERSION);
}

void ClientSession::Impl::take_asset_chunk(const wire::AssetChunk& chunk) {
  if (const std::string problem = assets.on_chunk(chunk); !problem.empty()) log(problem);
  request_asset();
}

void ClientSession::Impl::fetch(const std::vector<std::string>& kinds) {
  for (const std::string& line : assets.begin(of_kinds(kinds, scene.joined()->assets()))) log(line);
  request_asset();
}

void ClientSession::Impl::request_asset() {
  asset_request = 0;
  if (assets.is_done()) return announce_assets();
  const auto wanted = assets.next_request();
  if (!wanted) return;
  wire::ClientControl message;
  *message.mutable_get_asset() = *wanted;
  send_request(message);
  asset_request = last_request;
}

void ClientSession::Impl::announce_assets() {
  if (has_announced_assets) return;
  has_announced_assets = true;
  if (owner.on_assets) owner.on_assets();
  if (!settings.late_asset_kinds.empty()) fetch(settings.late_asset_kinds);
}

void ClientSession::Impl::send(wire::ClientControl& message) {
  frame_out.clear();
  proto::append_frame(message, frame_out);
  counters.bytes_sent += frame_out.size();
  transport.send_control(frame_out);
}

void ClientSession::Impl::send_request(wire::ClientControl& message) {
  message.set_request(++last_request);
  send(message);
}

void ClientSession::Impl::send_newest(LocalTime now) {
  const bool is_blocked = settings.state_over_tcp && transport.queued_control_bytes() > 0;
  stream.send_newest(scene.coupling(), is_blocked, now,
                     [this](std::span<const std::byte> datagram) { return deliver_state(datagram); });
}

bool ClientSession::Impl::deliver_state(std::span<const std::byte> datagram) {
  if (settings.state_over_tcp) {
    wire::ClientControl message;
    message.set_state_datagram(datagram.data(), datagram.size());
    send(message);
    return true;
  }
  if (!transport.send_datagram(datagram)) return false;
  counters.bytes_sent += datagram.size();
  return true;
}

ClientSession::ClientSession(SessionSettings settings, ClientTransport& transport, ClientMailboxes& mailboxes)
    : impl_(std::make_unique<Impl>(*this, std::move(settings), transport, mailboxes)) {}

ClientSession::~ClientSession() = default;

void ClientSession::start(LocalTime now) {
  impl_->connect(now);
}

void ClientSession::on_connected(LocalTime now) {
  impl_->connected(now);
}

void ClientSession::on_disconnected(LocalTime now, const std::string& why) {
  impl_->lose(now, why);
}

void ClientSession::on_control_bytes(std::span<const std::byte> bytes, LocalTime now) {
  impl_->take_control_bytes(bytes, now);
}

void ClientSession::on_datagram(std::span<const std::byte> datagram, LocalTime now) {
  impl_->counters.bytes_received += datagram.size();
  const proto::DropReason reason = impl_->stream.receive(datagram, now);
  impl_->counters.count_received(reason);
  if (reason == proto::DropReason::kNone) impl_->scene.note_grip(impl_->stream.newest_update(), now);
}

void ClientSession::poll(LocalTime now) {
  if (impl_->status.state == SessionState::kActive) impl_->send_newest(now);
  impl_->scene.check_when_due(now);
  impl_->check_time_outs(now);
}

void ClientSession::grab(BodyId body) {
  if (impl_->status.state != SessionState::kActive) return;
  wire::ClientControl message;
  message.mutable_grab()->set_body(body.value);
  impl_->send_request(message);
}

void ClientSession::release() {
  if (impl_->status.state != SessionState::kActive) return;
  wire::ClientControl message;
  message.mutable_release();
  impl_->send_request(message);
}

void ClientSession::set_parameter(const std::string& name, double value) {
  if (impl_->status.state != SessionState::kActive) return;
  wire::ClientControl message;
  message.mutable_set_parameter()->set_name(name);
  message.mutable_set_parameter()->set_value(value);
  impl_->send_request(message);
}

void ClientSession::leave(LocalTime) {
  const SessionState state = impl_->status.state;
  if (state == SessionState::kEnded) return;
  if (state == SessionState::kGreeting || state == SessionState::kJoining || state == SessionState::kActive) {
    wire::ClientControl message;
    message.mutable_leave();
    impl_->send(message);
  }
  impl_->end("left", false);
}

const SessionStatus& ClientSession::status() const {
  return impl_->status;
}
const wire::Joined* ClientSession::joined() const {
  return impl_->scene.joined();
}
std::uint32_t ClientSession::scene_generation() const {
  return impl_->scene.generation();
}
const CouplingCheck& ClientSession::coupling_check() const {
  return impl_->scene.last_check();
}
const std::string& ClientSession::room() const {
  return impl_->room;
}
const std::vector<wire::UserJoined>& ClientSession::users() const {
  return impl_->users;
}
const AssetMap& ClientSession::assets() const {
  return impl_->assets.assets();
}
net::ClockSync& ClientSession::clock_sync() {
  return impl_->stream.clock();
}
const SessionCounters& ClientSession::counters() const {
  return impl_->counters;
}

}  // namespace tandem::client
