// How often state is sent over a link that cannot carry every tick: less often, before it waits in queues.
#pragma once

#include <algorithm>
#include <limits>

#include "common/base/time.hpp"
#include "common/net/least_over.hpp"

namespace tandem::net {

/// One direction's. The sender asks may_send(), and hears how long what it sent has taken.
///
/// Model   A link that is given more than it carries queues: the least delay of a short time rises above the least of a
///         long one, which the jitter of single messages does not do. Of a queue that has grown by q while messages of
///         a time t were sent, the link carries 1 / (1 + q/t) of their rate. At kQueue the sender falls to the floor
///         rate until the queue is gone, and goes on with kMargin of what the link carries. A queue that neither
///         shrinks nor grows by 2 kGone within kWatch of that is a longer way, and nothing was too much. Without a
///         queue the rate is raised again, evenly, after kPatience; that doubles with each time that it was too much,
///         up to kMaxPatience. Delays are differences of two clocks: only their changes count, so the clocks need
///         not agree.
/// Limits  A queue of less than kQueue, and what a link with a short queue drops, are not noticed. A delay that stays
///         for longer than kShort though nothing of ours queues (a radio link's pause, somebody else's traffic) is
///         taken for one: that costs rate, which comes back within a minute, and no force.
/// Source  delay as the sign of a queue: LEDBAT (RFC 6817); rate from what arrives: Cardwell et al., "BBR:
///         congestion-based congestion control", ACM Queue 14(5), 2016. States instead of a window, for messages that
///         are not repeated, and the figures are ours
/// Thread  any, one at a time; no allocation
class SendRate {
 public:
  static constexpr Duration kQueue = std::chrono::milliseconds(30);
  static constexpr Duration kGone = std::chrono::milliseconds(10);
  static constexpr Duration kShort = std::chrono::milliseconds(50);
  static constexpr Duration kLong = std::chrono::seconds(10);
  static constexpr Duration kPatience = std::chrono::seconds(2);
  static constexpr Duration kMaxPatience = std::chrono::seconds(64);
  static constexpr Duration kWatch = std::chrono::seconds(3);
  static constexpr double kMargin = 0.85;
  static constexpr double kRise_per_s = 0.05;

  /// In      floor    longest time between two messages, however little the link carries
  ///         most_hz  as often as the sender would like to; at the floor rate or less it is never held back
  SendRate(Duration floor, double most_hz) : floor_(floor), most_hz_(most_hz) {}

  /// Whether a message may go now; the caller says so with sent() when it goes.
  bool may_send(Duration now) const noexcept { return now >= due_; }
  void sent(Duration now) noexcept;
  /// What was sent at `sent` has taken `delay`, by clocks that differ by a constant. Older than heard of: ignored.
  void delivered(Duration sent, Duration delay) noexcept;

  bool is_limited() const noexcept { return limit_hz_ < kUnlimited || is_draining_; }

 private:
  static constexpr double kUnlimited = std::numeric_limits<double>::infinity();

  Duration interval() const noexcept;
  void fall(Duration sent, Duration queue) noexcept;
  void drain(Duration sent, Duration queue) noexcept;
  void rise(Duration sent, Duration since_last) noexcept;
  void forget_delays() noexcept;

  Duration floor_;
  double most_hz_;
  double limit_hz_ = kUnlimited;
  double resume_hz_ = kUnlimited;
  bool is_draining_ = false;
  Duration due_ = Duration::min();
  Duration last_sent_ = Duration::min();
  double usual_interval_s_ = 0;         ///< of late; 0: not known
  Duration newest_ = Duration::min();   ///< sent, of what was heard of
  Duration calm_at_ = Duration::min();  ///< sent, of the last without a queue
  Duration changed_at_ = Duration::min();
  Duration least_draining_{0};  ///< queue since it is drained
  Duration most_draining_{0};
  Duration patience_ = kPatience;
  LeastOver recent_{kShort};
  LeastOver usual_{kLong};
};

}  // namespace tandem::net
