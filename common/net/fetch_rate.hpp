// Rate control of file requests over a link that also carries state updates. It transfers files as fast as possible
// without making state updates queue.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "common/base/time.hpp"
#include "common/net/least_over.hpp"

namespace tandem::net {

/// Rate control at the receiver of files. The receiver requests pieces of files and gets them in the requested order.
/// The sender only answers requests, so it needs no rate control.
///
/// Model   Capacity of the link: pieces are requested in pairs, whose two answers leave the sender together. The gap
///         between the arrivals of the two answers is the time that the bottleneck needs for the second answer and for
///         state updates sent between the two. Of the last kPairs gaps, the shorter half is used: the capacity is the
///         inverse of its mean time per byte.
///         Free rate: the capacity less the rate of state updates. With jitter, the shorter half of the gaps is too
///         short, so the inverse mean of all gaps is a second upper limit of the free rate.
///         Request rate:
///         * It begins at kFirstRate and doubles once per round trip, up to kShare of the free rate.
///         * A queue is detected from two minima of the delay of state updates: over the time kShort and over the time
///           kLong. There is a queue if the first exceeds the second by more than the allowance, which is initially
///           kQueue. The rate then falls by the factor kFall, and afterwards rises by the factor kCareful per round
///           trip instead of doubling.
///         * A queue at a rate below kFall of the free rate has another cause (jitter, a longer route, other traffic).
///           In this case the allowance is raised to this delay, up to kMaxAllowed, and the rate may double again.
///         Bytes requested but not yet received: at most rate · (least round trip + kAhead) plus two pieces.
/// Limits  A pair occupies the link for 3.5 ms at the current rate, or for the time of two pieces of kMinPiece. A state
///         update that is queued behind the pair is delayed by this time.
///         Jitter of single packets reduces the rate. Fraction of the free rate that is reached: 73 to 85 % without
///         jitter, 40 to 60 % with jitter of 2 ms (standard deviation), 6 to 30 % with 5 to 10 ms.
///         Without state updates no delay can be measured. The rate then follows from the pairs alone, and kAhead
///         bounds the queue.
/// Source  pairs: Keshav, "A control-theoretic approach to flow control", SIGCOMM 1991; use of less than the free rate,
///         and delay as the sign of a queue: LEDBAT (RFC 6817), Cardwell et al., "BBR", ACM Queue 14(5), 2016. The
///         constants are our choice
/// Thread  any, one at a time
class FetchRate {
 public:
  static constexpr double kFirstRate_bytes_per_s = 128e3;
  static constexpr double kMinRate_bytes_per_s = 16e3;
  static constexpr double kMaxRate_bytes_per_s = 32e6;
  static constexpr double kShare = 0.8;
  static constexpr double kFall = 0.5;
  static constexpr double kCareful = 1.05;
  static constexpr std::size_t kPairs = 16;
  static constexpr Duration kQueue = std::chrono::milliseconds(3);
  static constexpr Duration kMaxAllowed = std::chrono::milliseconds(50);
  static constexpr Duration kShort = std::chrono::milliseconds(60);
  static constexpr Duration kLong = std::chrono::seconds(10);
  static constexpr Duration kAhead = std::chrono::milliseconds(50);
  static constexpr std::size_t kMinPiece = 1024;
  static constexpr std::size_t kMaxPiece = 60 * 1024;
  static constexpr std::size_t kMaxInFlight = 512 * 1024;

  /// Returns the size in bytes of the piece to request now; 0: request nothing now. After each request the caller calls
  /// note_request().
  std::size_t bytes_to_request(LocalTime now) noexcept;
  void note_request(LocalTime now, std::size_t bytes);
  /// Records the arrival of the answer to the oldest outstanding request. The answer may be a refusal.
  void answered(LocalTime now) noexcept;
  /// Records the arrival of a state update. `delay` is its arrival time (local clock) minus its send time (sender's
  /// clock); it contains the constant offset of the two clocks.
  void state_came(LocalTime now, Duration delay, std::size_t bytes) noexcept;
  /// Restarts for a new connection: discards the outstanding requests and all measurements of the link.
  void reset() { *this = FetchRate(); }

  double rate_bytes_per_s() const noexcept { return rate_; }
  std::size_t in_flight_bytes() const noexcept { return in_flight_; }

 private:
  struct Request {
    LocalTime at{};
    std::size_t bytes = 0;
    bool is_second = false;
  };

  std::size_t piece() const noexcept;
  bool has_room_for(std::size_t bytes) const noexcept;
  void note_pair(std::size_t bytes, Duration apart) noexcept;
  /// Returns the free rate (see Model): the capacity less the rate of state updates, also limited by the mean of all
  /// gaps.
  double free_bytes_per_s() const noexcept;
  void end_round(LocalTime now) noexcept;

  std::deque<Request> requests_;
  std::size_t in_flight_ = 0;
  double rate_ = kFirstRate_bytes_per_s;
  double credit_ = 2.0 * kMinPiece;  ///< number of bytes that may be requested now
  LocalTime filled_{};
  bool has_half_pair_ = false;
  LocalTime half_pair_at_{};
  LocalTime first_came_{};
  std::array<double, kPairs> pair_s_per_byte_{};  ///< ring buffer with the times per byte of the last pairs
  std::size_t pairs_ = 0;                         ///< number of pairs measured so far
  LocalTime state_from_{};                        ///< start of the interval in which state_bytes_ is counted
  double state_bytes_ = 0;
  double state_bytes_per_s_ = -1;          ///< measured data rate of state updates; negative: not measured yet
  LocalTime begun_{};                      ///< time of the first answer on this connection
  Duration round_trip_ = Duration::max();  ///< smallest round trip so far
  LocalTime round_from_{};  ///< the current round ends with the first answer to a piece requested at or after this time
  bool is_careful_ = false;
  Duration allowed_ = kQueue;
  LeastOver recent_{kShort};
  LeastOver usual_{kLong};
};

}  // namespace tandem::net
