// Rate of file requests over a line that also carries state: as fast as the line allows before state queues.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "common/base/time.hpp"
#include "common/net/least_over.hpp"

namespace tandem::net {

/// Rate control at one receiver. It requests pieces of files and receives them in the requested order. The receiver
/// sets the pace, and the sender needs no control.
///
/// Model   Pieces are requested in pairs. The two answers leave together. The gap between their arrivals is the time
///         that the bottleneck needs for the second answer and for state in between. The mean time per byte of the
///         shorter half of the last kPairs gives the capacity. Free is the capacity less state, and at most the rate of
///         the mean over all pairs: in jitter the shorter half is far too short. The rate begins at kFirstRate and
///         doubles once a round trip, up to kShare of the free rate. A queue has grown when the least delay of state
///         over kShort exceeds the least over kLong by more than the allowance, at first kQueue. The rate then falls by
///         the factor kFall and afterwards rises by kCareful a round trip. If the rate is already below kFall of the
///         free rate, the delay has another cause (jitter, a longer route, other traffic): the allowance rises to it,
///         up to kMaxAllowed, and the rate may double again. In flight are at most rate · (least round trip + kAhead)
///         and two pieces.
/// Limits  A pair occupies the line for 3.5 ms at the rate, or as long as two pieces of kMinPiece; state behind it
///         waits as long. Jitter of single packets costs rate: 73 to 85 % of the free rate is reached without jitter,
///         40 to 60 % at a standard deviation of 2 ms; 6 to 30 % at 5 and 10 ms. Without state there is no delay to
///         measure: pairs alone set the rate, and kAhead bounds the queue.
/// Source  pairs: Keshav, "A control-theoretic approach to flow control", SIGCOMM 1991; less than the whole free rate,
///         and delay as the sign of a queue: LEDBAT (RFC 6817), Cardwell et al., "BBR", ACM Queue 14(5), 2016; figures
///         ours
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

  /// Bytes of the piece to request now; 0: not yet. The caller confirms a request with note_request().
  std::size_t bytes_to_request(LocalTime now) noexcept;
  void note_request(LocalTime now, std::size_t bytes);
  /// An answer arrived, possibly a refusal. It belongs to the oldest outstanding request.
  void answered(LocalTime now) noexcept;
  /// State arrived after `delay`, measured by clocks that differ by a constant.
  void state_came(LocalTime now, Duration delay, std::size_t bytes) noexcept;
  /// Starts anew for another connection: outstanding requests stay unanswered, and the line is unmeasured.
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
  /// Capacity that is neither state nor, as far as pairs show, other traffic.
  double free_bytes_per_s() const noexcept;
  void end_round(LocalTime now) noexcept;

  std::deque<Request> requests_;
  std::size_t in_flight_ = 0;
  double rate_ = kFirstRate_bytes_per_s;
  double credit_ = 2.0 * kMinPiece;  ///< bytes that may be requested
  LocalTime filled_{};
  bool has_half_pair_ = false;
  LocalTime half_pair_at_{};
  LocalTime first_came_{};
  std::array<double, kPairs> pair_s_per_byte_{};  ///< ring buffer of the last pairs
  std::size_t pairs_ = 0;                         ///< number of pairs so far
  LocalTime state_from_{};                        ///< start of the interval of state_bytes_
  double state_bytes_ = 0;
  double state_bytes_per_s_ = -1;          ///< negative: not measured yet
  LocalTime begun_{};                      ///< time of the first answer
  Duration round_trip_ = Duration::max();  ///< least so far
  LocalTime round_from_{};                 ///< a round ends with the answer to a piece requested since then
  bool is_careful_ = false;
  Duration allowed_ = kQueue;
  LeastOver recent_{kShort};
  LeastOver usual_{kLong};
};

}  // namespace tandem::net
