// One end of a connection's state stream: sends and receives datagrams, and accepts only the newest state. Client and
// server use this class with their own message types. It has no socket, clock or thread.
//
// Steps of receiving, in this order; the first failed check determines the drop reason (WIRE.md, "Checks on receive"):
//
//   1 size, version, type, ids           read_header()  the sender is still unknown
//   2 connection                         is_for()       the server also checks the source address
//   3 not a duplicate, not far ahead     receive()      tested with the replay window, which is not changed yet
//   4 authentic                          receive()      decrypted (datagram_seal.hpp); includes the epoch
//   5 newer than all received state      receive()      for state only: a path message may be late
//   6 payload, ranges, role              receive()      by the caller's `read`
//   7 window, newest, time stamps        receive()      updated last, so that a forged datagram changes nothing
//
// Steps of sending:
//
//   1 has the state changed enough?      admits()       otherwise suppressed (deadband)
//   2 does the link have capacity?       admits()       otherwise suppressed (pacing)
//   3 time stamps: send time, echo       send()         the only function that sets the time stamps of an update
//   4 can the byte stream accept data?   send()         otherwise dropped (kOverwritten), without using a sequence
//   5 header with the next sequence      send()
//   6 payload                            send()         by the caller's `append`
//   7 encryption                         send()         in place
//   8 delivery                           send()         by the caller's `deliver`; if it fails: dropped (kSendFailed)
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

/// Counters summed over all channels of a program.
struct ChannelCounters {
  DropCounters received_drops;
  DropCounters sent_drops;
  std::uint64_t datagrams_received = 0;
  std::uint64_t datagrams_sent = 0;
  std::uint64_t updates_suppressed = 0;  ///< updates withheld by the deadband
  std::uint64_t updates_paced = 0;       ///< updates withheld because the link has no capacity for them

  /// Counts a received datagram. `reason` is the reason why it was dropped; kNone: it was accepted.
  void count_received(DropReason reason) {
    ++datagrams_received;
    if (reason != DropReason::kNone) received_drops.add(reason);
  }
};

/// Performs step 1 of receiving: calls parse_header(), and then returns kType if the peer never sends this type.
/// In      expected  type of state that the peer sends; the corresponding path message is accepted as well
DropReason read_header(std::span<const std::byte> datagram, DatagramType expected, DatagramHeader& out);

/// Set of the last kSize received sequence numbers. It distinguishes late datagrams from duplicates. check() is called
/// before a datagram is authenticated, accept() only after that, so that a forged datagram has no effect.
class ReplayWindow {
 public:
  static constexpr std::size_t kSize = 4096;

  /// Returns kDuplicate if the sequence was already received, kLate if it is older than the window, and otherwise
  /// kNone.
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

/// One end of the state stream of a connection.
///
/// Thread  any, one at a time
class DatagramChannel {
 public:
  struct Settings {
    DatagramType sends = DatagramType::kClientUpdate;
    ConnectionId connection;
    std::uint8_t epoch = 0;
    double deadband = 0;     ///< Weber fraction (common/net/deadband.hpp); 0: no suppression
    double max_rate_hz = 0;  ///< rate at which the loop produces updates
    bool is_stream = false;  ///< true: datagrams are sent inside a TCP stream, which has its own flow control
    LocalTime opened{};      ///< time of opening; initial value of last_received() and last_sent()
    std::optional<secure::Exported> secret{};  ///< key material for the seals; empty: null cipher
  };
  /// In      counters  counters to update; they must outlive the channel
  DatagramChannel(const Settings& settings, ChannelCounters& counters);

  bool is_for(const DatagramHeader& header) const { return header.connection == settings_.connection; }
  /// Performs steps 3 to 7 of receiving for a state datagram with the header `header`.
  ///
  /// In      read(payload, update)  fills `update` from the payload; returns kNone, or why the payload is unusable
  /// Out     kNone, or the reason to drop the datagram; `update` is then unspecified
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
  /// Receives a path message (check of the client's network address). Unlike state, it is accepted even if it is older
  /// than the newest state.
  DropReason receive_path(const DatagramHeader& header, std::span<const std::byte> datagram, std::uint64_t& number);
  bool has_received() const { return has_received_; }
  LocalTime last_received() const { return last_received_; }
  LocalTime last_sent() const { return last_sent_; }

  /// Counts the updates that were overwritten before they could be sent. `number` is the number of the newest update,
  /// in the numbering of the loop. The missing numbers since the last call were overwritten.
  void count_overwritten(std::uint64_t number);
  /// Performs steps 1 and 2 of sending. Counts an update that is not admitted.
  ///
  /// In      may_wait                      true: the update may be withheld; false: it must be sent now, because the
  ///                                       user has acted
  ///         has_changed(deadband, since)  returns whether the change since the last sent update is perceptible, where
  ///                                       `since` is the time since that update. It is not called if an update is due
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
  /// Performs steps 3 to 8 of sending.
  ///
  /// In      is_blocked               true: earlier bytes still wait in the byte stream, so the datagram is dropped
  ///         append(update, bytes)    appends the encoded update with its time stamps to `bytes`
  ///         deliver(datagram)        sends the datagram; returns false if it cannot be sent now
  template <class Update, class Append, class Deliver>
  void send(Update& update, LocalTime now, bool is_blocked, const Append& append, const Deliver& deliver) {
    stamp(update, now);
    if (!begin_datagram(now, is_blocked)) return;
    append(update, datagram_);
    seal_.seal(sequence_, datagram_);
    count_sent(deliver(std::span<const std::byte>(datagram_)));
  }
  /// Returns an encrypted path message, valid until the next call of path_message() or send().
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
  std::uint64_t newest_ = 0;    ///< highest sequence number of the received state datagrams
  std::uint64_t sequence_ = 0;  ///< sequence number of the last datagram that was sent
  std::uint64_t number_ = 0;    ///< number of the newest update of the loop, from count_overwritten()
  bool has_received_ = false;
  Step received_step_;          ///< step of the newest received server update
  Duration received_stamp_{0};  ///< send time in the newest received datagram, on the peer's clock
  LocalTime last_received_{};
  LocalTime last_sent_{};
  Bytes datagram_;
};

}  // namespace tandem::proto
