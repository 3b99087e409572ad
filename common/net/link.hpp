// A simulated one-way network link with delay, jitter and loss. It has no clock and no socket. The lab uses it under
// virtual time, the client in real time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "common/base/time.hpp"

namespace tandem::net {

/// Distribution of a packet's delay; σ is LinkParameters::jitter.
///
/// Model   kNormal  delay is max(0, mean + σ·N(0,1)), with LinkParameters::delay as the mean. For large σ, the maximum
///                  raises the actual mean above that value
///         kPareto  delay is minimum + scale·((1 − u)^(−1/3) − 1), with u uniform and LinkParameters::delay as the
///                  minimum. The standard deviation is exactly σ, the mean is minimum + σ/√3, and P(delay exceeds the
///                  minimum by x) falls as x⁻³
///         kTrace   the delays of a given list in order, repeated from the start after the last one
enum class JitterDistribution { kNormal, kPareto, kTrace };

/// A delay that varies over time: linear between the given points, repeated after the last point.
struct DelayPath {
  struct Point {
    Duration at{0};
    Duration delay{0};
    bool operator==(const Point&) const = default;
  };
  std::string name;           ///< name of the file that defines the path
  std::vector<Point> points;  ///< points in order of time, the first at time 0, the last later; empty: no delay
  /// True: each link begins at a random point of the path, determined by its seed; false: at the first point.
  bool starts_anywhere = true;

  /// Returns the delay at a given time after the beginning of the path.
  Duration at(Duration time) const;
  Duration length() const { return points.empty() ? Duration(0) : points.back().at; }
  bool operator==(const DelayPath&) const = default;
};

/// Maximum loss of a link, as a fraction. With a higher loss, the periods without loss would be shorter than the
/// interval between packets.
inline constexpr double kMaxLoss = 0.95;

/// Parameters of one direction of a link.
struct LinkParameters {
  Duration delay{0};   ///< fixed part of the delay
  Duration jitter{0};  ///< standard deviation of the variable part of the delay
  JitterDistribution distribution = JitterDistribution::kNormal;
  std::vector<Duration> trace;  ///< for kTrace: list of delays, used in order; replaces delay + jitter
  /// Correlation time of the variable part, as caused by a queue; unused with kTrace. 0: each packet's delay is
  /// independent.
  Duration jitter_correlation{0};
  /// Delay added to the delays above. It models a varying load, a change of route or the retries of a radio link.
  DelayPath delay_path;
  /// True: packets may overtake each other. False: a late packet delays all packets behind it, and they arrive in a
  /// burst.
  bool allows_reordering = false;
  double loss = 0.0;  ///< fraction of lost packets, 0 to kMaxLoss
  /// Mean length of bad periods; all packets that are sent in a bad period are lost
  Duration mean_bad_period{from_seconds(0.020)};
  double duplication = 0.0;           ///< fraction of packets delivered twice
  double rate_limit_bytes_per_s = 0;  ///< rate of the link's line; 0: not limited
  std::size_t queue_limit = 4096;     ///< maximum number of packets in flight; further ones are dropped (tail drop)

  /// Returns whether datagrams are lost, duplicated or reordered. Such parameters must not be used for a stream,
  /// because TCP hides these effects.
  bool spoils_datagrams() const { return loss > 0 || duplication > 0 || allows_reordering; }
  /// Describes the first invalid field and its remedy, e.g. "loss is 1.2; it must be 0 to 0.95"; empty if all are
  /// valid.
  std::string problem() const;
};

/// Numbers of packets since construction.
struct LinkCounters {
  std::uint64_t sent = 0;
  std::uint64_t delivered = 0;
  std::uint64_t lost = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t queue_full = 0;
};

/// Transports packets (or stream chunks, if reliable) from send() to receive(). The times passed must not decrease.
///
/// Each packet passes three stages: the queue limit, the rate limit (which several links may share), and the loss.
/// Results are reproducible: they depend only on seed, stream and packets. The random delays of the original packets do
/// not depend on loss and duplication.
/// Thread  any, one at a time
class SimulatedLink {
 public:
  /// In      stream  number that distinguishes the links of one experiment
  /// Fails   std::invalid_argument with LinkParameters::problem()
  SimulatedLink(LinkParameters parameters, std::uint64_t seed, std::uint64_t stream);
  /// Returns a link for a byte stream. It uses delay and rate of the parameters, keeps the order, and never loses,
  /// duplicates or refuses data.
  static SimulatedLink reliable(LinkParameters parameters, std::uint64_t seed, std::uint64_t stream);
  /// Makes both links share one line, as the datagrams and the stream of one direction do. The rate limit then bounds
  /// the sum of their rates: each link waits until the bytes sent earlier on either link have passed. Both links should
  /// have equal rate limits.
  void share_line(SimulatedLink& other) { line_free_ = other.line_free_; }

  void send(LocalTime now, std::span<const std::byte> packet);
  /// Returns the next packet that is due at `now`, in order of arrival; empty if none is due.
  std::optional<std::vector<std::byte>> receive(LocalTime now);
  /// Returns the time for which a packet sent now would wait because of the rate limit.
  Duration line_wait(LocalTime now) const { return std::max(Duration{0}, *line_free_ - now); }
  /// Returns the number of bytes that are delayed by the rate limit.
  std::size_t queued_bytes(LocalTime now) const;
  /// Returns the time when the next packet is due; empty if none is in flight.
  std::optional<LocalTime> next_due() const;
  const LinkCounters& counters() const { return counters_; }
  /// Sets the parameters of packets sent from now on; packets in flight arrive as scheduled.
  /// Fails   std::invalid_argument with LinkParameters::problem()
  void set_parameters(LinkParameters parameters);

 private:
  bool is_lost(LocalTime now);
  /// A source of random delays with its own random sequence.
  struct DelaySource {
    Random random;
    std::size_t trace_position = 0;
    double deviate = 0;  ///< standard normal deviate that was drawn last
    LocalTime drawn{};   ///< time for which `deviate` was drawn
    bool has_drawn = false;
  };
  Duration draw_delay(DelaySource& source, LocalTime now);
  Duration variable_delay(DelaySource& source, LocalTime now) const;
  double draw_deviate(DelaySource& source, LocalTime now) const;
  Duration path_delay(LocalTime now);
  void enqueue(LocalTime due, std::span<const std::byte> packet);

  LinkParameters parameters_;
  bool is_reliable_ = false;
  Random loss_random_;
  DelaySource delays_;
  Random duplicate_random_;
  DelaySource duplicate_delays_;
  Duration path_from_{0};  ///< time along delay_path (from its beginning) at which this link begins
  LocalTime path_began_{};
  bool has_path_begun_ = false;
  bool in_bad_period_ = false;
  LocalTime period_end_{};
  bool has_period_ = false;
  LocalTime last_due_{};
  std::shared_ptr<LocalTime> line_free_ =
      std::make_shared<LocalTime>();  ///< time when the line becomes idle; shared by all links of the line
  std::multimap<LocalTime, std::vector<std::byte>>
      in_flight_;  ///< packets, sorted by due time, then by order of sending
  LinkCounters counters_;
};

}  // namespace tandem::net
