#include "client/session/session.hpp"

#include <algorithm>
#include <array>

#include "client/session/scene_from_wire.hpp"
#include "common/net/deadband.hpp"
#include "common/net/send_rate.hpp"
#include "proto/control_framing.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/state_codec.hpp"

namespace tandem::client {
namespace {

constexpr const char* kProgram = "tandem-client";
/// An echo of a time stamp older than this tells nothing about the clock.
constexpr Duration kMaxEchoAge = std::chrono::seconds(10);
constexpr std::size_t kMaxTextBytes = 400;

/// Text from the wire, made fit for a terminal: one line, no escape sequences, bounded.
std::string printable(std::string text) {
  if (text.size() > kMaxTextBytes) text.resize(kMaxTextBytes);
  for (char& character : text) {
    const auto byte = static_cast<unsigned char>(character);
    if (byte < 0x20 || byte == 0x7F) character = '?';
  }
  return text;
}

std::string milliseconds(Duration duration) {
  return std::to_string(duration / std::chrono::milliseconds(1)) + " ms";
}

/// True for refusals that time can cure: our own old connection may still hold the place.
bool may_pass(wire::ErrorCode code) {
  return code == wire::ERROR_ROOM_FULL || code == wire::ERROR_SERVER_FULL;
}

}  // namespace

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
        mailboxes(session_mailboxes),
        coupling_watch(settings.device),
        deadband(settings.deadband),
        retry_delay(settings.reconnect_delay),
        assets(kMaxAssetBytes, settings.asset_store) {}

  // Connecting and losing
  /// Of the haptic loop.
  static constexpr double kTicks_per_s = 1000;
  static net::SendRate freshly_paced() { return net::SendRate(net::kDeadbandFloor, kTicks_per_s); }
  void enter(SessionState state, LocalTime now);
  void connect(LocalTime now);
  void connected(LocalTime now);
  void lose(LocalTime now, const std::string& why, bool is_final = false);
  void end(const std::string& why, bool is_setup_error);
  void hide_scene();
  void check_time_outs(LocalTime now);

  // Control
  void take_control_bytes(std::span<const std::byte> bytes, LocalTime now);
  void handle(const wire::ServerControl& message, LocalTime now);
  bool handle_active(const wire::ServerControl& message, LocalTime now);
  void take_welcome(const wire::Welcome& welcome, LocalTime now);
  void take_joined(const wire::Joined& joined, LocalTime now);
  void hold(BodyId body, LocalTime now);
  void check_coupling();
  void check_changed_coupling(LocalTime now);
  void take_error(const wire::ServerControl& message, LocalTime now);
  void take_goodbye(const wire::Goodbye& goodbye, LocalTime now);
  void take_parameter(const wire::ParameterSet& parameter, LocalTime now);
  void take_asset_chunk(const wire::AssetChunk& chunk);
  void request_asset();
  void announce_assets();
  void send(wire::ClientControl& message);
  void send_request(wire::ClientControl& message);

  // State
  proto::DropReason take_datagram(std::span<const std::byte> datagram, LocalTime now);
  void take_update(LocalTime now);
  void send_newest(LocalTime now);
  bool must_be_told(const proto::ClientUpdate& update, LocalTime now) const;
  bool may_wait(const proto::ClientUpdate& update, LocalTime now) const;
  void send_update(proto::ClientUpdate update, LocalTime now);

  void log(const std::string& line) const {
    if (owner.on_log) owner.on_log(printable(line));
  }

  ClientSession& owner;
  SessionSettings settings;
  ClientTransport& transport;
  ClientMailboxes& mailboxes;
  CouplingWatch coupling_watch;
  net::Deadband deadband;
  net::SendRate send_rate = freshly_paced();

  SessionStatus status;
  LocalTime entered{};  // the present state
  bool has_joined = false;
  Duration retry_delay;
  proto::FrameReader reader;
  std::uint32_t last_request = 0;
  std::uint32_t asset_request = 0;  // 0: none awaited

  std::unique_ptr<wire::Joined> joined;
  std::string room;
  HapticScene scene;
  BodyId held;
  AssetFetcher assets;
  bool has_announced_assets = false;  // of this join

  ConnectionId connection;
  std::uint8_t epoch = 0;
  std::uint64_t sequence = 0;
  proto::FreshnessFilter freshness;
  net::ClockSync clock;
  ReceivedUpdate received;  // newest
  bool has_update = false;  // since the last join
  LocalTime last_arrival{};
  LocalTime last_sent{};
  proto::ClientUpdate newest;  // of the haptic thread since the last join
  LocalTime newest_taken{};
  proto::ClientUpdate told;  // sent last
  SessionCounters counters;
  proto::Bytes datagram_out;
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
  hello.add_capabilities(settings.state_transport == StateTransport::kTcp ? proto::kCapabilityStateTcp
                                                                          : proto::kCapabilityStateUdp);
  send_request(message);
}

void ClientSession::Impl::lose(LocalTime now, const std::string& why, bool is_final) {
  if (status.state == SessionState::kEnded || status.state == SessionState::kWaiting) return;
  if (is_final || !has_joined) {
    end(why, true);
  } else if (!settings.may_reconnect) {
    end(why, false);
  } else {
    hide_scene();
    transport.close();
    enter(SessionState::kWaiting, now);
    status.why = printable(why);
    log(why + "; trying again in " + milliseconds(retry_delay));
  }
}

void ClientSession::Impl::end(const std::string& why, bool is_setup_error) {
  hide_scene();
  transport.close();
  status = {SessionState::kEnded, printable(why), is_setup_error};
  // A set-up error is the program's last word; it prints `why` itself.
  if (!is_setup_error) log(why);
}

void ClientSession::Impl::hide_scene() {
  coupling_watch.forget_changes();
  if (!scene.may_drive) return;
  scene.may_drive = scene.may_display = false;
  mailboxes.scene.publish(scene);
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
      if (now - last_arrival < settings.silence_timeout) return;
      if (has_update) {
        lose(now, "nothing came from the server for " + milliseconds(settings.silence_timeout));
      } else {
        lose(now, "joined, but no state arrived within " + milliseconds(settings.silence_timeout) +
                      (settings.state_transport == StateTransport::kUdp
                           ? "; is UDP blocked? state can go over TCP instead (--transport tcp)"
                           : ""));
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
      hold(BodyId{message.grabbed().body()}, now);
      log("grabbed body " + std::to_string(message.grabbed().body()));
      return true;
    case wire::ServerControl::kReleased:
      hold(BodyId{}, now);
      log("released body " + std::to_string(message.released().body()));
      return true;
    case wire::ServerControl::kUserJoined:
      log("user " + std::to_string(message.user_joined().user()) + " \"" + message.user_joined().name() + "\" is here");
      return true;
    case wire::ServerControl::kUserLeft:
      log("user " + std::to_string(message.user_left().user()) + " left");
      return true;
    case wire::ServerControl::kAssetChunk:
      take_asset_chunk(message.asset_chunk());
      return true;
    case wire::ServerControl::kParameterSet:
      take_parameter(message.parameter_set(), now);
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
  send_request(message);
}

void ClientSession::Impl::take_joined(const wire::Joined& answer, LocalTime now) {
  HapticScene offered = scene;
  std::string problem = fill_haptic_scene(answer, offered);
  if (problem.empty() && answer.role() != settings.role) problem = "role is not the one asked for";
  if (!problem.empty()) {
    wire::ClientControl message;
    message.mutable_leave();
    send(message);
    lose(now, "the server's scene cannot be used: " + problem, true);
    return;
  }
  if (has_joined) ++counters.reconnects;
  has_joined = true;
  joined = std::make_unique<wire::Joined>(answer);
  scene = offered;
  ++scene.generation;
  scene.local_model = nullptr;
  held = BodyId{};
  coupling_watch.note_grip(held, Vec3::Zero(), now);
  check_coupling();
  sequence = 0;
  freshness.reset();
  clock.reset();
  send_rate = freshly_paced();
  has_update = false;
  last_arrival = now;
  last_sent = now;
  newest = proto::ClientUpdate{};
  retry_delay = settings.reconnect_delay;
  enter(SessionState::kActive, now);
  status.why.clear();
  // What the haptic thread wrote before it knew this scene does not belong to it.
  mailboxes.outbox.poll();
  mailboxes.scene.publish(scene);
  log("joined \"" + joined->scene().name() + "\" as user " + std::to_string(joined->user()));
  if (owner.on_joined) owner.on_joined(*joined);
  has_announced_assets = false;
  for (const std::string& line : assets.begin(joined->assets())) log(line);
  request_asset();
}

void ClientSession::Impl::hold(BodyId body, LocalTime now) {
  held = body;
  coupling_watch.note_change(now);
}

// The session goes on either way, and the hand drives its tool: only what it would feel is left out.
void ClientSession::Impl::check_coupling() {
  if (!scene.may_drive) return;
  const bool may_display = coupling_watch.check(scene, *joined, held);
  if (may_display != scene.may_display) {
    log(may_display ? "the coupling is stable on this device again"
                    : "the coupling is unstable on this device: no force is displayed");
  }
  scene.may_display = may_display;
}

void ClientSession::Impl::check_changed_coupling(LocalTime now) {
  if (!coupling_watch.is_due(now)) return;
  coupling_watch.forget_changes();
  const bool did_display = scene.may_display;
  check_coupling();
  if (scene.may_display != did_display) mailboxes.scene.publish(scene);
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

void ClientSession::Impl::take_parameter(const wire::ParameterSet& parameter, LocalTime now) {
  const proto::CouplingField* field = proto::find_coupling_field(parameter.name());
  if (field == nullptr || !field->accepts(parameter.value())) {
    log("ignored parameter " + parameter.name() + " = " + std::to_string(parameter.value()));
    return;
  }
  scene.coupling.*(field->value) = parameter.value();
  // At once, so that the hand's end of the coupling stays the server's; whether it is fit, when all of it is here.
  mailboxes.scene.publish(scene);
  coupling_watch.note_change(now);
  log(parameter.name() + " is now " + std::to_string(parameter.value()));
  if (owner.on_parameter) owner.on_parameter(parameter);
}

void ClientSession::Impl::take_asset_chunk(const wire::AssetChunk& chunk) {
  if (const std::string problem = assets.on_chunk(chunk); !problem.empty()) log(problem);
  request_asset();
}

void ClientSession::Impl::request_asset() {
  asset_request = 0;
  if (assets.has_all()) return announce_assets();
  const auto wanted = settings.fetch_assets ? assets.next_request() : std::nullopt;
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

proto::DropReason ClientSession::Impl::take_datagram(std::span<const std::byte> datagram, LocalTime now) {
  proto::DatagramHeader header;
  if (const proto::DropReason reason = proto::parse_header(datagram, header); reason != proto::DropReason::kNone)
    return reason;
  if (header.type != proto::DatagramType::kServerUpdate) return proto::DropReason::kType;
  const bool is_ours = header.connection == connection && header.epoch == epoch;
  if (status.state != SessionState::kActive || !is_ours) return proto::DropReason::kUnknownConnection;
  // As on the server: the filter advances only for a datagram that passes everything.
  proto::FreshnessFilter advanced = freshness;
  if (const proto::DropReason reason = advanced.accept(header.sequence); reason != proto::DropReason::kNone)
    return reason;
  proto::ServerUpdate& update = received.update;
  if (const proto::DropReason reason = proto::parse_server_update(proto::payload_of(datagram), update);
      reason != proto::DropReason::kNone) {
    return reason;
  }
  freshness = advanced;
  take_update(now);
  return proto::DropReason::kNone;
}

void ClientSession::Impl::take_update(LocalTime now) {
  const proto::ServerUpdate& update = received.update;
  has_update = true;
  coupling_watch.note_grip(update.held_body, update.X_BT.p, now);
  last_arrival = now;
  const Duration echo_age = now - update.echoed_sent;
  if (update.echoed_sent != LocalTime{}) {
    const Duration sent = update.echoed_sent.time_since_epoch();
    send_rate.delivered(sent, update.received.time_since_epoch() - sent);
  }
  if (update.echoed_sent != LocalTime{} && echo_age >= Duration{0} && echo_age < kMaxEchoAge) {
    clock.add({update.echoed_sent, update.received, update.sent, now});
  }
  received.received = now;
  received.clock_offset = clock.has_offset() ? clock.offset(now) : Duration{0};
  if (mailboxes.inbox.publish(received)) counters.received_drops.add(proto::DropReason::kOverwritten);
}

void ClientSession::Impl::send_newest(LocalTime now) {
  if (mailboxes.outbox.poll()) {
    const Tick before = newest.input_tick;
    newest = mailboxes.outbox.front();
    newest_taken = now;
    if (before.value != 0 && newest.input_tick.value > before.value + 1) {
      counters.sent_drops.add(proto::DropReason::kOverwritten, newest.input_tick.value - before.value - 1);
    }
    if (!must_be_told(newest, now)) {
      ++counters.updates_held_back;
    } else if (may_wait(newest, now)) {
      ++counters.updates_paced;
    } else {
      send_update(newest, now);
    }
  } else if (now - last_sent >= settings.keep_alive) {
    // The last word of the haptic thread, so that a stall neither opens the hand nor takes energy back; where the
    // handle is by now nobody knows.
    proto::ClientUpdate alive = newest;
    alive.handle_valid = false;
    if (now - newest_taken > settings.buttons_kept) alive.buttons = 0;
    send_update(alive, now);
  }
}

// Waves are sums that the receiver smooths as they come: none of them is left out because it is small.
bool ClientSession::Impl::must_be_told(const proto::ClientUpdate& update, LocalTime now) const {
  if (deadband.is_off() || !has_update || now - last_sent >= net::kDeadbandFloor) return true;
  if (update.mode == proto::ClientMode::kWave || update.mode != told.mode) return true;
  if (update.handle_valid != told.handle_valid || update.buttons != told.buttons) return true;
  const net::FeltStiffness stiffness{scene.coupling.stiffness_n_per_m, scene.coupling.stiffness_n_m_per_rad};
  const auto notices = [&](const RigidState& state, const RigidState& last) {
    return deadband.notices(state, last, now - last_sent, net::BetweenStates::kExtrapolated,
                            received.update.wrench_on_hand_W, stiffness);
  };
  if (notices(update.handle, told.handle)) return true;
  return update.mode == proto::ClientMode::kLocalModel && notices(update.tool, told.tool);
}

/// For a link that does not carry every tick; not what a hand has just pressed. A stream paces itself.
bool ClientSession::Impl::may_wait(const proto::ClientUpdate& update, LocalTime now) const {
  const bool is_news =
      update.handle_valid != told.handle_valid || update.buttons != told.buttons || update.mode != told.mode;
  return settings.state_transport == StateTransport::kUdp && !is_news && !send_rate.may_send(now.time_since_epoch());
}

void ClientSession::Impl::send_update(proto::ClientUpdate update, LocalTime now) {
  last_sent = now;
  send_rate.sent(now.time_since_epoch());
  told = update;
  update.sent = now;
  if (has_update) {
    update.acknowledged_step = received.update.step;
    update.acknowledged_sent = received.update.sent;
    update.acknowledged_held = now - received.received;
  }
  if (settings.role == wire::ROLE_OBSERVER) {
    update.handle = RigidState{};
    update.handle_valid = false;
    update.buttons = 0;
  }
  const bool goes_over_tcp = settings.state_transport == StateTransport::kTcp;
  if (goes_over_tcp && transport.queued_control_bytes() > 0) {
    counters.sent_drops.add(proto::DropReason::kOverwritten);
    return;
  }
  datagram_out.clear();
  proto::append_header({proto::DatagramType::kClientUpdate, epoch, connection, ++sequence}, datagram_out);
  proto::append_client_update(update, datagram_out);
  if (goes_over_tcp) {
    wire::ClientControl message;
    message.set_state_datagram(datagram_out.data(), datagram_out.size());
    send(message);
  } else if (!transport.send_datagram(datagram_out)) {
    counters.sent_drops.add(proto::DropReason::kSendFailed);
    return;
  } else {
    counters.bytes_sent += datagram_out.size();
  }
  ++counters.datagrams_sent;
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
  ++impl_->counters.datagrams_received;
  impl_->counters.bytes_received += datagram.size();
  const proto::DropReason reason = impl_->take_datagram(datagram, now);
  if (reason != proto::DropReason::kNone) impl_->counters.received_drops.add(reason);
}

void ClientSession::poll(LocalTime now) {
  if (impl_->status.state == SessionState::kActive) impl_->send_newest(now);
  impl_->check_changed_coupling(now);
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

void ClientSession::use_local_model(LocalModel* model) {
  if (impl_->status.state != SessionState::kActive) return;
  impl_->scene.local_model = model;
  impl_->mailboxes.scene.publish(impl_->scene);
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
  return impl_->joined.get();
}
const CouplingCheck& ClientSession::coupling_check() const {
  return impl_->coupling_watch.last();
}
const std::string& ClientSession::room() const {
  return impl_->room;
}
const AssetMap& ClientSession::assets() const {
  return impl_->assets.assets();
}
net::ClockSync& ClientSession::clock_sync() {
  return impl_->clock;
}
const SessionCounters& ClientSession::counters() const {
  return impl_->counters;
}

}  // namespace tandem::client
