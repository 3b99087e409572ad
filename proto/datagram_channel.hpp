// One end of a connection's state stream: sends and receives datagrams, and keeps only the newest state. Client and
// server use the same class, each with its own message; it has no socket, clock or thread.
//
// Receive, in this order; the first failed check determines the drop reason (WIRE.md, "Checks on receive"):
//
//   1 size, version, type, ids           read_header()  the sender is still unknown
//   2 connection                         is_for()       the server also checks the source address
//   3 not a copy, not far ahead          receive()      by the replay window, which is not changed yet
//   4 authentic                          receive()      opened (datagram_seal.hpp); includes the epoch
//   5 newer than all state before        receive()      state only: a path message may be late
//   6 payload, ranges, role              receive()      by the owner's `read`
//   7 window, newest, stamps             receive()      last, so that a damaged or forged datagram changes nothing
//
// Send:
//
//   1 has the state changed enough?      admits()       else suppressed (deadband)
//   2 does the link have capacity?       admits()       else paced
//   3 stamps: own time, echo             send()         the only place that stamps an update
//   4 is the stream not blocked?         send()         else dropped as overwritten, without using a sequence
//   5 header with the next sequence      send()
//   6 payload                            send()         by the owner's `append`
//   7 seal                               send()         in place
//   8 deliver                            send()         by the owner's `deliver`; refused: dropped as send_failed
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <span>

#include "common/net/deadband.hpp"
#include "common/net/send_rate.hpp"
#include "proto/datagram.hpp"
#include "proto/datagram_seal.hpp"
#include "proto/state.hpp"

namespace tandem::proto {

/// Counters of all channels of a program together.
struct ChannelCounters {
  DropCounters received_drops;
  DropCounters sent_drops;
  std::uint64_t datagrams_received = 0;
  std::uint64_t datagrams_sent = 0;
  std::uint64_t updates_suppressed = 0;  ///< suppressed by the deadband
  std::uint64_t updates_paced = 0;       ///< suppressed because the link has no capacity for them

  /// Counts a received datagram; `reason` is why it was dropped, or kNone.
  void count_received(DropReason reason) {
    ++datagrams_received;
    if (reason != DropReason::kNone) received_drops.add(reason);
  }
};

/// Step 1 of receiving: parse_header(), and kType for types that the other end never sends.
/// In      expected  type of the other end's state; its path message is accepted too
DropReason read_header(std::span<const std::byte> datagram, DatagramType expected, DatagramHeader& out);

/// Set of the last kSize received sequences, which distinguishes late datagrams from copies. check() precedes the
/// opening of a datagram and accept() follows it, so that a forged datagram changes nothing.
class ReplayWindow {
 public:
  static constexpr std::size_t kSize = 4096;

  /// Returns kDuplicate for a received sequence, kLate for one older than the window.
  DropReason check(std::uint64_t sequence) const {
    if (sequence > newest_) return DropReason::kNone;
    if (newest_ - sequence >= kSize) return DropReason::kLate;
    return seen_.test(sequence % kSize) ? DropReason::kDuplicate : DropReason::kNone;
  }
  /// Adds a sequence that check() accepted.
  void accept(std::uint64_t sequence) {
    if (sequence > newest_) {
      if (sequence - newest_ >= kSize) seen_.reset();
      for (std::uint64_t gap = newest_ + 1; gap < sequence && sequence - newest_ < kSize; ++gap)
        seen_.reset(gap % kSize);
      newest_ = sequence;
    }
    seen_.set(sequence % kSize);
  }

 private:
  std::uint64_t newest_ = 0;
  std::bitset<kSize> seen_;
};

/// State stream of one connection at one end.
///
/// Thread  one at a time
class DatagramChannel {
 public:
  struct Settings {
    DatagramType sends = DatagramType::kClientUpdate;
    ConnectionId connection;
    std::uint8_t epoch = 0;
    double deadband = 0;     ///< Weber fraction (common/net/deadband.hpp); 0: no suppression
    double max_rate_hz = 0;  ///< rate of the loop that creates the updates
    bool is_stream = false;  ///< datagrams travel inside a byte stream, which has its own flow control
    LocalTime opened{};      ///< counts as the time of the last datagram before the first one
    std::optional<secure::Exported> secret{};  ///< for the seals; none: null cipher
  };
  /// In      counters  must outlive the channel
  DatagramChannel(const Settings& settings, ChannelCounters& counters);

  bool is_for(const DatagramHeader& header) const { return header.connection == settings_.connection; }
  /// Performs steps 3 to 7 for a state datagram with the header `header`.
  ///
  /// In      read(payload, update)  fills `update`, or returns why it is unusable
  /// Out     `update` is unspecified unless kNone
  template <class Update, class Read>
  DropReason receive(const DatagramHeader& header, std::span<const std::byte> datagram, LocalTime now, Update& update,
                     const Read& read) {
    std::span<const std::byte> payload;
    if (const DropReason reason = open(header, datagram, payload); reason != DropReason::kNone) return reason;
    if (header.sequence < newest_) {
      window_.accept(header.sequence);
      return DropReason::kLate;
    }
    if (const DropReason reason = read(payload, update); reason != DropReason::kNone) return reason;
    window_.accept(header.sequence);
    newest_ = header.sequence;
    note_stamps(update, now);
    return DropReason::kNone;
  }
  /// Receives a path message, which may be older than the newest state.
  DropReason receive_path(const DatagramHeader& header, std::span<const std::byte> datagram, std::uint64_t& number);
  bool has_received() const { return has_received_; }
  LocalTime last_received() const { return last_received_; }
  LocalTime last_sent() const { return last_sent_; }

  /// Counts overwritten updates: the loop numbers its updates, and those between the last number and this one were
  /// replaced before they could be sent.
  void count_overwritten(std::uint64_t number);
  /// Performs steps 1 and 2; counts an update that is not admitted.
  ///
  /// In      may_wait                   the link's rate may hold the update back; false after an action of the hand
  ///         has_changed(deadband, since)  whether the change is perceptible, `since` the last update was sent; called
  ///         only when the update is not due anyway
  template <class HasChanged>
  bool admits(LocalTime now, bool may_wait, const HasChanged& has_changed) {
    const Duration since = now - last_sent_;
    const bool is_due = deadband_.is_off() || since >= net::kDeadbandFloor;
    if (!is_due && !has_changed(deadband_, since)) {
      ++counters_->updates_suppressed;
      return false;
    }
    if (may_wait && !settings_.is_stream && !send_rate_.may_send(now.time_since_epoch())) {
      ++counters_->updates_paced;
      return false;
    }
    return true;
  }
  /// Performs steps 3 to 8.
  ///
  /// In      is_blocked               the stream still has bytes to send
  ///         append(update, bytes)    appends the encoded, stamped update to `bytes`
  ///         deliver(datagram)        returns false when it could not be sent now
  template <class Update, class Append, class Deliver>
  void send(Update& update, LocalTime now, bool is_blocked, const Append& append, const Deliver& deliver) {
    stamp(update, now);
    if (!begin_datagram(now, is_blocked)) return;
    append(update, datagram_);
    seal_.seal(sequence_, datagram_);
    count_sent(deliver(std::span<const std::byte>(datagram_)));
  }
  /// Returns a sealed path message, valid until the next one or the next update.
  std::span<const std::byte> path_message(std::uint64_t number, LocalTime now);

 private:
  DropReason open(const DatagramHeader& header, std::span<const std::byte> datagram,
                  std::span<const std::byte>& payload);
  void begin_header(DatagramType type, LocalTime now);
  void note_stamps(const ClientUpdate& update, LocalTime now);
  void note_stamps(const ServerUpdate& update, LocalTime now);
  void note_received(Duration sent_by_peer, LocalTime now);
  void stamp(ClientUpdate& update, LocalTime now) const;
  void stamp(OwnUpdate& update, LocalTime now) const;
  bool begin_datagram(LocalTime now, bool is_blocked);
  void count_sent(bool was_delivered);

  Settings settings_;
  ChannelCounters* counters_;
  DatagramSeal seal_;
  DatagramSeal opener_;
  ReplayWindow window_;
  net::Deadband deadband_;
  net::SendRate send_rate_;
  std::uint64_t newest_ = 0;    ///< newest sequence of received state
  std::uint64_t sequence_ = 0;  ///< last sequence sent
  std::uint64_t number_ = 0;    ///< number of the loop's last update
  bool has_received_ = false;
  Step received_step_;          ///< step of the newest server update
  Duration received_stamp_{0};  ///< peer's time stamp of its newest datagram
  LocalTime last_received_{};
  LocalTime last_sent_{};
  Bytes datagram_;
};

}  // namespace tandem::proto
