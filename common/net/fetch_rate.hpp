// How fast files may be asked for over a line that carries state too: as fast as it has room, before state waits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "common/base/time.hpp"
#include "common/net/least_over.hpp"

namespace tandem::net {

/// One receiver's. It asks for pieces of files and gets each as it was asked for, in order: so the receiver sets the
/// sender's pace, and the sender needs to know nothing.
///
/// Model   Pieces are asked for in pairs. The two answers leave together, and arrive apart by the time that the narrowest
///         line on the way takes for the second and for the state between. Of the last kPairs, the mean time a byte of the
///         shorter half says what the line carries: what it leaves beside state is free, but no more than the mean of all
///         of them gives, for in jitter the shorter half is far too short. The rate begins at kFirstRate and doubles once
///         a round trip, up to kShare of what is free. When the least delay of state over kShort rises above the least
///         over kLong by more than is allowed, kQueue at first, a queue has grown: the rate falls to kFall of itself, and
///         from then on rises by kCareful a round trip. Where it is already below kFall of what seems free, the delay has
///         another cause (jitter, a longer way, somebody else's traffic): as much is allowed from then on, up to
///         kMaxAllowed, and the rate may double again. In flight is at most what the rate gives in the least round trip
///         and kAhead.
/// Limits  A pair takes the line for 3.5 ms at the rate, or as long as two pieces of kMinPiece, so state behind it waits as
///         long. Jitter of single packets costs rate: 73 to 85 % of what is free without, 40 to 60 % at a standard
///         deviation of 2 ms, 6 to 30 % at 5 and 10 ms. Without state there is no delay to see: then pairs alone set the
///         rate, and kAhead bounds the queue.
/// Source  pairs: Keshav, "A control-theoretic approach to flow control", SIGCOMM 1991; less than all of what is free,
///         and delay as the sign of a queue: LEDBAT (RFC 6817), Cardwell et al., "BBR", ACM Queue 14(5), 2016; figures ours
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

  /// Bytes of the piece to ask for now; 0: not yet. The caller says so with asked().
  std::size_t may_ask(LocalTime now) noexcept;
  void asked(LocalTime now, std::size_t bytes);
  /// The answer to what was asked first of what is not answered yet, a refusal too.
  void answered(LocalTime now) noexcept;
  /// State that has taken `delay`, by clocks that differ by a constant.
  void state_came(LocalTime now, Duration delay, std::size_t bytes) noexcept;
  /// The connection is another one: what was asked for is not answered any more, and nothing is known of the line.
  void reset() { *this = FetchRate(); }

  double rate_bytes_per_s() const noexcept { return rate_; }
  std::size_t in_flight_bytes() const noexcept { return in_flight_; }

 private:
  struct Asked {
    LocalTime at{};
    std::size_t bytes = 0;
    bool is_second = false;
  };

  std::size_t piece() const noexcept;
  bool has_room_for(std::size_t bytes) const noexcept;
  void note_pair(std::size_t bytes, Duration apart) noexcept;
  /// What of the line is neither state nor, for all that pairs show, taken by others.
  double free_bytes_per_s() const noexcept;
  void end_round(LocalTime now) noexcept;

  std::deque<Asked> asked_;
  std::size_t in_flight_ = 0;
  double rate_ = kFirstRate_bytes_per_s;
  double credit_ = 2.0 * kMinPiece;  ///< bytes that may be asked for
  LocalTime filled_{};
  bool has_half_pair_ = false;
  LocalTime half_pair_at_{};
  LocalTime first_came_{};
  std::array<double, kPairs> pair_s_per_byte_{};  ///< the last, in turn
  std::size_t pairs_ = 0;                         ///< so far
  LocalTime state_from_{};                        ///< the next are of what came since
  double state_bytes_ = 0;
  double state_bytes_per_s_ = -1;          ///< less than 0: not known yet
  LocalTime begun_{};                      ///< first answer
  Duration round_trip_ = Duration::max();  ///< least
  LocalTime round_from_{};                 ///< a round ends with what was asked for since
  bool is_careful_ = false;
  Duration allowed_ = kQueue;
  LeastOver recent_{kShort};
  LeastOver usual_{kLong};
};

}  // namespace tandem::net
