#include "proto/datagram_channel.hpp"

namespace tandem::proto {

DropReason read_header(std::span<const std::byte> datagram, DatagramType expected, DatagramHeader& out) {
  if (const DropReason reason = parse_header(datagram, out); reason != DropReason::kNone) return reason;
  return out.type == expected ? DropReason::kNone : DropReason::kType;
}

DatagramChannel::DatagramChannel(const Settings& settings, ChannelCounters& counters)
    : settings_(settings),
      counters_(&counters),
      deadband_(settings.deadband),
      send_rate_(net::kDeadbandFloor, settings.max_rate_hz),
      last_heard_(settings.opened),
      last_sent_(settings.opened) {}

DropReason DatagramChannel::check_freshness(std::uint64_t sequence) const {
  if (sequence == newest_) return DropReason::kDuplicate;
  if (sequence < newest_) return DropReason::kLate;
  return sequence - newest_ > kMaxSequenceJump ? DropReason::kSequenceJump : DropReason::kNone;
}

void DatagramChannel::note_heard(Duration sent_by_peer, LocalTime now) {
  has_heard_ = true;
  heard_stamp_ = sent_by_peer;
  last_heard_ = now;
}

// How long what was sent has taken: from the own stamp that comes back to the peer's stamp of its arrival, by two
// clocks. A server update has both; a client update says how long the client has had what it acknowledges.
void DatagramChannel::take_stamps(const ClientUpdate& update, LocalTime now) {
  note_heard(update.sent.time_since_epoch(), now);
  if (update.acknowledged_sent == ServerTime{}) return;
  const Duration sent = update.acknowledged_sent.time_since_epoch();
  send_rate_.delivered(sent, update.sent.time_since_epoch() - update.acknowledged_held - sent);
}

void DatagramChannel::take_stamps(const ServerUpdate& update, LocalTime now) {
  note_heard(update.sent.time_since_epoch(), now);
  heard_step_ = update.step;
  if (update.echoed_sent == LocalTime{}) return;
  const Duration sent = update.echoed_sent.time_since_epoch();
  send_rate_.delivered(sent, update.received.time_since_epoch() - sent);
}

void DatagramChannel::stamp(ClientUpdate& update, LocalTime now) const {
  update.sent = now;
  update.acknowledged_step = heard_step_;
  update.acknowledged_sent = ServerTime(heard_stamp_);
  update.acknowledged_held = has_heard_ ? now - last_heard_ : Duration{0};
}

void DatagramChannel::stamp(ServerUpdate& update, LocalTime now) const {
  update.echoed_sent = LocalTime(heard_stamp_);
  update.received = has_heard_ ? server_time_of_own_clock(last_heard_) : ServerTime{};
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
  datagram_.clear();
  append_header({settings_.sends, settings_.epoch, settings_.connection, ++sequence_}, datagram_);
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
