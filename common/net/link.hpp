// A network link with simulated delay, jitter and loss in one direction. It has no clock and no socket, so the same
// class runs under virtual time in the lab and live inside the client.
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

/// How the delay of a packet varies; σ is LinkParameters::jitter.
///
/// Model   kNormal  max(0, delay + σ·N(0,1)): a jitter that is large relative to the delay raises the mean
///         kPareto  delay + scale·((1 − u)^(−1/3) − 1), u uniform: `delay` is the minimum, σ is exact, the mean is σ/√3
///                  above the minimum, P(later by x) falls as x⁻³
///         kTrace   the delays of a list, in turn
enum class JitterDistribution { kNormal, kPareto, kTrace };

/// Change of a delay over time: piecewise linear between points, repeated after the last point.
struct DelayPath {
  struct Point {
    Duration at{0};
    Duration delay{0};
    bool operator==(const Point&) const = default;
  };
  std::string name;             ///< file name
  std::vector<Point> points;    ///< in order of time, the first at 0, the last later; empty: no delay
  bool starts_anywhere = true;  ///< each link begins at a random point, by its seed; false: at the first point

  /// Delay at a time since the path began.
  Duration at(Duration time) const;
  Duration length() const { return points.empty() ? Duration(0) : points.back().at; }
  bool operator==(const DelayPath&) const = default;
};

/// Maximum loss of a link: with more, the good periods would be shorter than a packet's spacing.
inline constexpr double kMaxLoss = 0.95;

/// One direction of a link.
struct LinkParameters {
  Duration delay{0};   ///< fixed part
  Duration jitter{0};  ///< standard deviation of the variable part
  JitterDistribution distribution = JitterDistribution::kNormal;
  std::vector<Duration> trace;  ///< kTrace: delays used in turn instead of delay + jitter
  /// Correlation time of the variable part, as of a queue; not for kTrace. 0: independent for each packet.
  Duration jitter_correlation{0};
  DelayPath delay_path;  ///< added to the delays above: a varying load, a change of route, a radio's retries
  /// False: a packet waits for those sent before it, so a late one delays its successors, and they arrive in bursts.
  bool allows_reordering = false;
  double loss = 0.0;                              ///< overall fraction lost, 0 to kMaxLoss
  Duration mean_bad_period{from_seconds(0.020)};  ///< mean length of bad periods; every packet in one is lost
  double duplication = 0.0;                       ///< fraction delivered twice
  double rate_limit_bytes_per_s = 0;              ///< 0: unlimited
  std::size_t queue_limit = 4096;                 ///< packets in flight; more are dropped (tail drop)

  /// True when datagrams are lost, duplicated or reordered. It must not be set for a stream, which hides this.
  bool spoils_datagrams() const { return loss > 0 || duplication > 0 || allows_reordering; }
  /// The first invalid field and its remedy, e.g. "loss is 1.2; it must be 0 to 0.95"; empty when all are valid.
  std::string problem() const;
};

/// Counts of packets so far.
struct LinkCounters {
  std::uint64_t sent = 0;
  std::uint64_t delivered = 0;
  std::uint64_t lost = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t queue_full = 0;
};

/// Carries packets (or, when reliable, stream chunks) from send() to receive(). Times must not decrease.
///
/// A packet passes the queue limit, then the rate limit, which other links may share, then the loss. The same seed and
/// stream give the same result for the same packets. Loss and duplication do not change the draws of the packets' own
/// delays.
/// Thread  one at a time
class SimulatedLink {
 public:
  /// `stream` distinguishes the links of one experiment.
  /// Fails   std::invalid_argument with LinkParameters::problem()
  SimulatedLink(LinkParameters parameters, std::uint64_t seed, std::uint64_t stream);
  /// A link for a byte stream: same delay and rate, order kept, nothing lost, duplicated or refused.
  static SimulatedLink reliable(LinkParameters parameters, std::uint64_t seed, std::uint64_t stream);
  /// Makes both links share one line, as the datagrams and the stream of one direction do. The rate limit, which should
  /// be the same in both, bounds their sum; each waits for bytes that the other has sent before.
  void share_line(SimulatedLink& other) { line_free_ = other.line_free_; }

  void send(LocalTime now, std::span<const std::byte> packet);
  /// The next packet due at `now`, in order of arrival; empty when none is due.
  std::optional<std::vector<std::byte>> receive(LocalTime now);
  /// Time that a packet sent now waits for the rate limit.
  Duration line_wait(LocalTime now) const { return std::max(Duration{0}, *line_free_ - now); }
  /// Bytes that still wait for the rate limit.
  std::size_t queued_bytes(LocalTime now) const;
  /// Time when the next packet is due, if any is in flight.
  std::optional<LocalTime> next_due() const;
  const LinkCounters& counters() const { return counters_; }
  /// Applies to packets sent from now on; packets in flight arrive as scheduled.
  /// Fails   std::invalid_argument with LinkParameters::problem()
  void set_parameters(LinkParameters parameters);

 private:
  bool is_lost(LocalTime now);
  /// Random source of delays, with a sequence of its own.
  struct DelaySource {
    Random random;
    std::size_t trace_position = 0;
    double deviate = 0;  ///< standard normal deviate drawn last …
    LocalTime drawn{};   ///< … for this time
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
  Duration path_from_{0};  ///< point of the path at which the link begins
  LocalTime path_began_{};
  bool has_path_begun_ = false;
  bool in_bad_period_ = false;
  LocalTime period_end_{};
  bool has_period_ = false;
  LocalTime last_due_{};
  std::shared_ptr<LocalTime> line_free_ =
      std::make_shared<LocalTime>();                            ///< when the line becomes idle; shared by its links
  std::multimap<LocalTime, std::vector<std::byte>> in_flight_;  ///< sorted by due time, then order of sending
  LinkCounters counters_;
};

}  // namespace tandem::net
