#include "proto/datagram_channel.hpp"

#include <cstring>

namespace tandem::proto {

DropReason read_header(std::span<const std::byte> datagram, DatagramType expected, DatagramHeader& out) {
  if (const DropReason reason = parse_header(datagram, out); reason != DropReason::kNone) return reason;
  return out.type == expected || out.type == path_beside(expected) ? DropReason::kNone : DropReason::kType;
}

DatagramChannel::DatagramChannel(const Settings& settings, ChannelCounters& counters)
    : settings_(settings),
      counters_(&counters),
      seal_(settings.secret, DatagramSeal::Use::kSeal, settings.sends == DatagramType::kClientUpdate, settings.epoch),
      opener_(settings.secret, DatagramSeal::Use::kOpen, settings.sends != DatagramType::kClientUpdate, settings.epoch),
      deadband_(settings.deadband),
      send_rate_(net::kDeadbandFloor, settings.max_rate_hz),
      last_received_(settings.opened),
      last_sent_(settings.opened) {
  settings_.secret.reset();  // wipes the secret: the seals have derived their keys from it
}

/// Performs steps 3 and 4 of receiving (datagram_channel.hpp).
DropReason DatagramChannel::open(const DatagramHeader& header, std::span<const std::byte> datagram,
                                 std::span<const std::byte>& payload) {
  if (const DropReason reason = window_.check(header.sequence); reason != DropReason::kNone) return reason;
  if (header.sequence > newest_ && header.sequence - newest_ > kMaxSequenceJump) return DropReason::kSequenceJump;
  return opener_.open(header, datagram, payload);
}

DropReason DatagramChannel::receive_path(const DatagramHeader& header, std::span<const std::byte> datagram,
                                         std::uint64_t& number) {
  // A path message proves an address only if it is authenticated, which the null cipher does not do.
  if (opener_.is_null()) return DropReason::kType;
  std::span<const std::byte> payload;
  if (const DropReason reason = open(header, datagram, payload); reason != DropReason::kNone) return reason;
  if (payload.size() != kPathBytes) return DropReason::kMalformed;
  window_.accept(header.sequence);
  std::memcpy(&number, payload.data(), sizeof number);
  return DropReason::kNone;
}

std::span<const std::byte> DatagramChannel::path_message(std::uint64_t number, LocalTime now) {
  begin_header(path_beside(settings_.sends), now);
  const auto bytes = std::as_bytes(std::span(&number, 1));
  datagram_.insert(datagram_.end(), bytes.begin(), bytes.end());
  seal_.seal(sequence_, datagram_);
  return datagram_;
}

void DatagramChannel::begin_header(DatagramType type, LocalTime now) {
  seal_.keep_fresh(now);
  datagram_.clear();
  append_header({type, seal_.epoch(), settings_.connection, ++sequence_}, datagram_);
}

void DatagramChannel::note_received(Duration sent_by_peer, LocalTime now) {
  has_received_ = true;
  received_stamp_ = sent_by_peer;
  last_received_ = now;
}

// Reports the transit time of an update that this end has sent. It is the difference of two times: the send time, which
// the peer returns, and the arrival time on the peer's clock. A server update contains both. In a client update, the
// arrival time is computed: its send time minus the time for which the client held the acknowledged update.
void DatagramChannel::note_stamps(const ClientUpdate& update, LocalTime now) {
  note_received(update.sent.time_since_epoch(), now);
  if (update.acknowledged_sent == ServerTime{}) return;
  const Duration sent = update.acknowledged_sent.time_since_epoch();
  send_rate_.delivered(sent, update.sent.time_since_epoch() - update.acknowledged_held - sent);
}

void DatagramChannel::note_stamps(const ServerUpdate& update, LocalTime now) {
  note_received(update.sent.time_since_epoch(), now);
  received_step_ = update.step;
  if (update.echoed_sent == LocalTime{}) return;
  const Duration sent = update.echoed_sent.time_since_epoch();
  send_rate_.delivered(sent, update.received.time_since_epoch() - sent);
}

void DatagramChannel::stamp(ClientUpdate& update, LocalTime now) const {
  update.sent = now;
  update.acknowledged_step = received_step_;
  update.acknowledged_sent = ServerTime(received_stamp_);
  update.acknowledged_held = has_received_ ? now - last_received_ : Duration{0};
}

void DatagramChannel::stamp(OwnUpdate& update, LocalTime now) const {
  update.echoed_sent = LocalTime(received_stamp_);
  update.received = has_received_ ? server_time_of_own_clock(last_received_) : ServerTime{};
  update.sent = server_time_of_own_clock(now);
}

void DatagramChannel::count_overwritten(std::uint64_t number) {
  if (number_ != 0 && number > number_ + 1) {
    counters_->sent_drops.add(DropReason::kOverwritten, number - number_ - 1);
  }
  number_ = number;
}

bool DatagramChannel::begin_datagram(LocalTime now, bool is_blocked) {
  last_sent_ = now;
  send_rate_.sent(now.time_since_epoch());
  if (is_blocked) {
    counters_->sent_drops.add(DropReason::kOverwritten);
    return false;
  }
  begin_header(settings_.sends, now);
  return true;
}

void DatagramChannel::count_sent(bool was_delivered) {
  if (was_delivered) {
    ++counters_->datagrams_sent;
  } else {
    counters_->sent_drops.add(DropReason::kSendFailed);
  }
}

}  // namespace tandem::proto
