#include "client/session/session.hpp"

#include <algorithm>

#include "client/session/session_impl.hpp"

namespace tandem::client {
namespace {

constexpr const char* kProgram = "tandem-client";

std::string milliseconds(Duration duration) {
  return std::to_string(duration / std::chrono::milliseconds(1)) + " ms";
}

}  // namespace

void ClientSession::Impl::enter(SessionState state, LocalTime now) {
  status.state = state;
  entered = now;
  emit(event::StateChanged{state, status.why});
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
    status.why = printable(why);
    enter(SessionState::kWaiting, now);
    log(why + "; trying again in " + milliseconds(retry_delay));
    refuse_poses(why);
  }
}

void ClientSession::Impl::end(const std::string& why, bool is_setup_error) {
  stop_state();
  transport.close();
  status = {SessionState::kEnded, printable(why), is_setup_error};
  emit(event::StateChanged{status.state, status.why});
  // A set-up error is not logged here, because main() prints it.
  if (!is_setup_error) log(why);
  refuse_poses(why);
}

void ClientSession::Impl::stop_state() {
  stream.end();
  scene.hide();
}

void ClientSession::Impl::check_time_outs(LocalTime now) {
  switch (status.state) {
    case SessionState::kConnecting:
    case SessionState::kGreeting:
    case SessionState::kJoining: {
      if (now - entered < settings.setup_timeout) return;
      const std::string tried = transport.connecting_to();
      lose(now, "the server did not answer within " + milliseconds(settings.setup_timeout) + " (" +
                    std::string(name_of(status.state)) + ")" + (tried.empty() ? "" : ": " + tried));
      return;
    }
    case SessionState::kActive:
      if (now - stream.last_received() < settings.silence_timeout) return;
      if (stream.has_received()) {
        lose(now, "nothing was received from the server for " + milliseconds(settings.silence_timeout));
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

void ClientSession::Impl::note_assets(bool has_risen) {
  if (has_risen && owner.on_assets) owner.on_assets();
}

void ClientSession::Impl::request_assets(LocalTime now) {
  while (const auto wanted = assets.next_request(last_request + 1, now)) {
    wire::ClientControl message;
    *message.mutable_get_asset() = *wanted;
    send_request(message);
  }
}

void ClientSession::set_asset_kinds(std::vector<std::string> kinds) {
  impl_->assets.set_kinds(std::move(kinds));
  if (impl_->status.state == SessionState::kActive) impl_->note_assets(impl_->assets.begin(joined()->assets()));
}

AssetLevel ClientSession::asset_level() const {
  return impl_->status.state == SessionState::kActive ? impl_->assets.level() : AssetLevel::kNone;
}

ClientSession::ClientSession(SessionSettings settings, ClientTransport& transport, ClientMailboxes& mailboxes)
    : impl_(std::make_unique<Impl>(*this, std::move(settings), transport, mailboxes)) {
  impl_->scene.set_workspace(impl_->settings.workspace);
  impl_->scene.set_nudges(impl_->settings.has_nudges);
}

ClientSession::~ClientSession() = default;

void ClientSession::set_credentials(const Credentials& credentials) {
  impl_->credentials = credentials;
}

std::shared_ptr<const Credentials> ClientSession::credentials_beside() const {
  return impl_->credentials.beside();
}

void ClientSession::start(LocalTime now) {
  impl_->connect(now);
}

void ClientSession::on_connected(LocalTime now) {
  impl_->connected(now);
}

void ClientSession::on_disconnected(LocalTime now, const std::string& why) {
  impl_->lose(now, why);
}

void ClientSession::fail(const std::string& why) {
  impl_->end("the session ended by a fault of this program: " + why, false);
}

void ClientSession::on_control_bytes(std::span<const std::byte> bytes, LocalTime now) {
  impl_->receive_control_bytes(bytes, now);
}

void ClientSession::on_datagram(std::span<const std::byte> datagram, LocalTime now) {
  impl_->counters.bytes_received += datagram.size();
  const proto::DropReason reason = impl_->stream.receive(
      datagram, now, [this](std::span<const std::byte> answer) { return impl_->deliver_state(answer); });
  impl_->counters.count_received(reason);
  if (reason != proto::DropReason::kNone) return;
  const proto::ServerUpdate& update = impl_->stream.newest_update();
  impl_->scene.note_grip(update, now);
  impl_->assets.note_state(now, now.time_since_epoch() - update.sent.time_since_epoch(), datagram.size());
}

void ClientSession::poll(LocalTime now) {
  if (impl_->status.state == SessionState::kActive) {
    impl_->send_newest(now);
    impl_->note_assets(impl_->assets.advance(now));
    impl_->request_assets(now);
  }
  impl_->scene.check_when_due(now);
  impl_->check_time_outs(now);
}

bool ClientSession::has_nudges() const {
  return impl_->settings.has_nudges;
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
const haptics::CouplingLawInfo& ClientSession::law() const {
  return impl_->scene.law();
}

const haptics::CouplingParameters& ClientSession::coupling() const {
  return impl_->scene.coupling();
}
const CouplingCheck& ClientSession::coupling_check() const {
  return impl_->scene.last_check();
}
bool ClientSession::has_state() const {
  return impl_->status.state == SessionState::kActive && impl_->stream.has_received();
}
const std::string& ClientSession::room() const {
  return impl_->room;
}
const std::vector<std::string>& ClientSession::rooms() const {
  return impl_->rooms;
}
const std::vector<std::pair<LocalTime, wire::Pointed>>& ClientSession::pointed() const {
  return impl_->pointed;
}

const std::shared_ptr<const std::vector<wire::KeptPose>>& ClientSession::kept_poses() const {
  return impl_->poses.kept();
}

const std::optional<wire::PoseProgress>& ClientSession::pose_progress() const {
  return impl_->poses.progress();
}

const std::vector<std::shared_ptr<const std::vector<Vec3>>>& ClientSession::soft_offsets() const {
  return impl_->soft_offsets;
}
const std::shared_ptr<const GameReport>& ClientSession::game() const {
  return impl_->scene.game().report();
}
const HandStart& ClientSession::hand_start() const {
  return impl_->scene.hand_start();
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
