// Send rate of state over a link that cannot carry every tick: reduces the rate before messages queue.
#pragma once

#include <algorithm>
#include <limits>

#include "common/base/time.hpp"
#include "common/net/least_over.hpp"

namespace tandem::net {

/// Congestion control of one direction. The sender polls may_send() and receives the delay of its messages.
///
/// Model   A link that receives more than its capacity queues: the least delay over a short time then exceeds the least
///         over a long time. Jitter of single messages does not do this. If a queue grew by q while messages of a time
///         t were sent, the link carries 1 / (1 + q/t) of their rate. At a queue of kQueue the sender falls to the
///         floor rate until the queue is gone, and then resumes at kMargin of the capacity. If the queue changes by
///         less than 2 kDrained within kWatch, it is a longer route, not congestion, and the limit stays. Without a
///         queue the rate rises evenly after kPatience; that time doubles with each further congestion, up to
///         kMaxPatience. Delays are differences of two clocks; only their changes count, so the clocks need not agree.
/// Limits  A queue below kQueue, and drops by a link with a short queue, are not detected. A delay that lasts longer
///         than kShort without own queueing (a pause of a radio link, other traffic) counts as a queue. This costs
///         rate, which recovers within a minute, and no force.
/// Source  delay as the sign of a queue: LEDBAT (RFC 6817); rate from arrivals: Cardwell et al., "BBR: congestion-based
///         congestion control", ACM Queue 14(5), 2016. A rate of states instead of a window, for messages that are not
///         repeated, and the figures are ours
/// Thread  any, one at a time; no allocation
class SendRate {
 public:
  static constexpr Duration kQueue = std::chrono::milliseconds(30);
  static constexpr Duration kDrained = std::chrono::milliseconds(10);
  static constexpr Duration kShort = std::chrono::milliseconds(50);
  static constexpr Duration kLong = std::chrono::seconds(10);
  static constexpr Duration kPatience = std::chrono::seconds(2);
  static constexpr Duration kMaxPatience = std::chrono::seconds(64);
  static constexpr Duration kWatch = std::chrono::seconds(3);
  static constexpr double kMargin = 0.85;
  static constexpr double kRise_per_s = 0.05;

  /// In      floor    longest time between two messages, however small the capacity
  ///         most_hz  desired rate; at the floor rate or below there is no limit
  SendRate(Duration floor, double most_hz) : floor_(floor), most_hz_(most_hz) {}

  /// Returns whether to send a message now; the caller confirms each message with sent().
  bool may_send(Duration now) const noexcept { return now >= due_; }
  void sent(Duration now) noexcept;
  /// The message sent at `sent` took `delay`, by clocks that differ by a constant. Older messages than the newest are
  /// ignored.
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
  double usual_interval_s_ = 0;         ///< recent mean; 0: unknown
  Duration newest_ = Duration::min();   ///< send time of the newest reported message
  Duration calm_at_ = Duration::min();  ///< send time of the last message without a queue
  Duration changed_at_ = Duration::min();
  Duration least_draining_{0};  ///< range of the queue while draining
  Duration most_draining_{0};
  Duration patience_ = kPatience;
  LeastOver recent_{kShort};
  LeastOver usual_{kLong};
};

}  // namespace tandem::net
