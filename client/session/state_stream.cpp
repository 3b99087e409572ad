#include "client/session/state_stream.hpp"

#include "proto/state_codec.hpp"

namespace tandem::client {
namespace {

/// Maximum age of an echoed time stamp that may be used to estimate the clock offset.
constexpr Duration kMaxEchoAge = std::chrono::seconds(10);
/// Rate of the haptic loop.
constexpr double kTickRate_hz = 1000;

}  // namespace

StateStream::StateStream(const SessionSettings& settings, ClientMailboxes& mailboxes, proto::ChannelCounters& counters)
    : settings_(settings), mailboxes_(mailboxes), counters_(counters) {}

void StateStream::begin(ConnectionId connection, std::uint8_t epoch, const std::optional<secure::Exported>& secret,
                        LocalTime now) {
  channel_.emplace(proto::DatagramChannel::Settings{.sends = proto::DatagramType::kClientUpdate,
                                                    .connection = connection,
                                                    .epoch = epoch,
                                                    .deadband = settings_.deadband,
                                                    .max_rate_hz = kTickRate_hz,
                                                    .is_stream = settings_.state_over_tcp,
                                                    .opened = now,
                                                    .secret = secret},
                   counters_);
  clock_.reset();
  newest_ = sent_ = proto::ClientUpdate{};
  newest_step_ = Step{};
  newest_stepped_ = ServerTime{};
  // The pending client update is discarded, because the haptic thread wrote it for the previous scene.
  mailboxes_.outbox.poll();
}

proto::DropReason StateStream::receive(std::span<const std::byte> datagram, LocalTime now, const Deliver& answer) {
  proto::DatagramHeader header;
  if (const proto::DropReason reason = proto::read_header(datagram, proto::DatagramType::kServerUpdate, header);
      reason != proto::DropReason::kNone) {
    return reason;
  }
  if (!channel_ || !channel_->is_for(header)) return proto::DropReason::kUnknownConnection;
  if (header.type != proto::DatagramType::kServerUpdate) return answer_challenge(header, datagram, now, answer);
  const auto read = [this](std::span<const std::byte> payload, proto::ServerUpdate& out) {
    const proto::DropReason reason = proto::parse_server_update(payload, out);
    if (reason != proto::DropReason::kNone) return reason;
    // Drops repeated states. So a server that only repeats its last state counts as silent.
    const bool goes_on = out.step > newest_step_ && out.stepped > newest_stepped_;
    return goes_on ? proto::DropReason::kNone : proto::DropReason::kDuplicate;
  };
  const proto::DropReason reason = channel_->receive(header, datagram, now, received_.update, read);
  if (reason != proto::DropReason::kNone) return reason;
  newest_step_ = received_.update.step;
  newest_stepped_ = received_.update.stepped;
  publish_received(now);
  return reason;
}

proto::DropReason StateStream::answer_challenge(const proto::DatagramHeader& header,
                                                std::span<const std::byte> datagram, LocalTime now,
                                                const Deliver& answer) {
  std::uint64_t number = 0;
  const proto::DropReason reason = channel_->receive_path(header, datagram, number);
  if (reason == proto::DropReason::kNone) answer(channel_->path_message(number, now));
  return reason;
}

void StateStream::publish_received(LocalTime now) {
  const proto::ServerUpdate& update = received_.update;
  const Duration echo_age = now - update.echoed_sent;
  if (update.echoed_sent != LocalTime{} && echo_age >= Duration{0} && echo_age < kMaxEchoAge) {
    clock_.add(update.echoed_sent, update.received, update.sent, now);
  }
  received_.received = now;
  received_.clock_offset = clock_.has_offset() ? clock_.offset(now) : Duration{0};
  if (mailboxes_.inbox.publish(received_)) counters_.received_drops.add(proto::DropReason::kOverwritten);
}

void StateStream::send_newest(const haptics::CouplingParameters& coupling, bool is_blocked, LocalTime now,
                              const Deliver& deliver) {
  if (!channel_) return;
  if (mailboxes_.outbox.poll()) {
    newest_ = mailboxes_.outbox.front();
    newest_taken_ = now;
    channel_->count_overwritten(newest_.input_tick.value);
    const auto changed = [&](const net::Deadband& deadband, Duration since) {
      return has_changed(deadband, since, coupling);
    };
    if (channel_->admits(now, !is_urgent(), changed)) send(newest_, is_blocked, now, deliver);
  } else if (now - channel_->last_sent() >= settings_.keep_alive) {
    // Sends the last update again during a stall of the haptic thread. So in a short stall the server does not release
    // the held body, and receives the energy sums. The handle is marked invalid, because its current pose is not known.
    proto::ClientUpdate alive = newest_;
    alive.handle_valid = false;
    if (now - newest_taken_ > settings_.buttons_kept) alive.buttons = 0;
    send(alive, is_blocked, now, deliver);
  }
}

// Returns true if the update must be sent. An update with a wave is sent even if the change is within the deadband: a
// wave is a running integral, and the receiver smooths the integrals in the order of arrival.
bool StateStream::has_changed(const net::Deadband& deadband, Duration since,
                              const haptics::CouplingParameters& coupling) const {
  if (!has_received() || newest_.mode == proto::ClientMode::kWave || is_urgent()) return true;
  const Pose X_believed = integrate(sent_.handle.X, sent_.handle.V, to_seconds(since));
  return deadband.notices(newest_.on_hand_W, sent_.on_hand_W) ||
         deadband.notices(newest_.handle, sent_.handle.V, X_believed, received_.update.wrench_on_hand_W,
                          coupling.stiffness_n_per_m, coupling.stiffness_n_m_per_rad);
}

/// Returns true for changes of buttons, mode or validity, which must be sent at once.
bool StateStream::is_urgent() const {
  return newest_.handle_valid != sent_.handle_valid || newest_.buttons != sent_.buttons || newest_.mode != sent_.mode;
}

void StateStream::send(proto::ClientUpdate update, bool is_blocked, LocalTime now, const Deliver& deliver) {
  sent_ = update;
  if (settings_.role == wire::ROLE_OBSERVER) {
    update.handle = RigidState{};
    update.handle_valid = false;
    update.buttons = 0;
  }
  channel_->send(update, now, is_blocked, proto::append_client_update, deliver);
}

}  // namespace tandem::client
