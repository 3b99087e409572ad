#include "server/session/state_stream.hpp"

#include <utility>

namespace tandem::server {

StateStream::StateStream(const RoomSeats& seats, const Seat& seat, const proto::DatagramChannel::Settings& settings,
                         proto::ChannelCounters& counters)
    : seats_(seats),
      seat_(seat),
      is_suppressing_(settings.deadband > 0),
      is_stream_(settings.is_stream),
      counters_(counters),
      channel_(settings, counters) {}

proto::DropReason StateStream::receive(const proto::DatagramHeader& header, std::span<const std::byte> datagram,
                                       LocalTime now) {
  proto::ClientUpdate input;
  const auto read = [this](std::span<const std::byte> payload, proto::ClientUpdate& out) {
    const proto::DropReason reason = proto::parse_client_update(payload, out);
    if (reason != proto::DropReason::kNone) return reason;
    const bool is_allowed = has_tool(seat_.role) || !out.handle_valid;
    return is_allowed ? proto::DropReason::kNone : proto::DropReason::kNotAllowed;
  };
  const proto::DropReason reason = channel_.receive(header, datagram, now, input, read);
  if (reason != proto::DropReason::kNone) return reason;
  mode_ = input.mode;
  ++taken_;
  has_hand_ = has_hand_ || input.handle_valid;  // never true for an observer
  if (std::exchange(acknowledged_, input.acknowledged_sent) != input.acknowledged_sent &&
      input.acknowledged_sent != ServerTime{}) {
    round_trip_ = server_time_of_own_clock(now) - input.acknowledged_sent - input.acknowledged_held;
  }
  // The updates of an observer's client only keep the connection alive and show the client's address to the server.
  // They are not passed to the room.
  if (has_tool(seat_.role) && seats_.room().input(seat_.index).publish(input)) {
    counters_.received_drops.add(proto::DropReason::kOverwritten);
  }
  return proto::DropReason::kNone;
}

std::size_t StateStream::send(const RoomUpdate& published, bool is_blocked, LocalTime now, const Deliver& deliver) {
  proto::OwnUpdate own = published.own[seat_.index];
  channel_.count_overwritten(own.step.value);
  unsent_faults_ |= own.tick_faults;
  // Over UDP, the address of the client is unknown until its first datagram has arrived.
  if (!channel_.has_received() && !is_stream_) return 0;
  const auto changed = [&](const net::Deadband& deadband, Duration since) {
    return has_changed(deadband, since, own, published.users.size());
  };
  if (!channel_.admits(now, true, changed)) return 0;
  if (is_suppressing_) {
    sent_ = own;
    users_sent_ = published.users.size();
  }
  own.tick_faults = std::exchange(unsent_faults_, 0);
  std::size_t thinned = 0;
  const auto append = [&](const proto::OwnUpdate& update, proto::Bytes& out) {
    encoder_.append(update, published.bodies, published.users, seat_.user, out);
    thinned = encoder_.thinned();
  };
  channel_.send(own, now, is_blocked, append, deliver);
  return thinned;
}

// Returns whether the update differs by more than the deadband from the state that the client assumes without it.
// * A client without a local model couples its hand to the last received tool pose.
// * A client with a local model predicts the tool's motion, so its assumed pose is the last sent pose, extrapolated at
//   the sent velocity.
bool StateStream::has_changed(const net::Deadband& deadband, Duration since, const proto::OwnUpdate& own,
                              std::size_t users) const {
  if (mode_ == proto::ClientMode::kWave || own.held_body != sent_.held_body) return true;
  if (own.tick_faults != sent_.tick_faults || users != users_sent_) return true;
  const haptics::CouplingParameters coupling = seats_.coupling_in_force(seat_);
  const RigidState& sent = sent_.tool;
  const bool has_model = mode_ == proto::ClientMode::kLocalModel;
  const Pose X_believed = has_model ? integrate(sent.X, sent.V, to_seconds(since)) : sent.X;
  return deadband.notices(own.wrench_on_hand_W, sent_.wrench_on_hand_W) ||
         deadband.notices(own.tool, sent.V, X_believed, own.wrench_on_hand_W, coupling.stiffness_n_per_m,
                          coupling.stiffness_n_m_per_rad);
}

}  // namespace tandem::server
