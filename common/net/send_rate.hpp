// Rate control of state messages over a link that cannot carry every tick: reduces the rate before messages queue.
#pragma once

#include <algorithm>
#include <limits>

#include "common/base/time.hpp"
#include "common/net/least_over.hpp"

namespace tandem::net {

/// Congestion control of one direction. The sender calls may_send() before each message, and delivered() with the delay
/// of each delivered message.
///
/// Model   Queue: if a link receives more than its capacity, messages queue. The least delay over kShort then exceeds
///         the least delay over kLong; the difference is the queue. Jitter of single messages does not change either
///         minimum.
///         Capacity: if a queue grew by the delay q while messages were sent during a time t, the capacity of the link
///         is 1 / (1 + q/t) of the messages' rate.
///         Rate:
///         1. When the queue exceeds kQueue, the sender reduces its rate to the floor rate until the queue is gone. It
///            then resumes at kMargin of the capacity.
///         2. If the queue varies by less than 2 kDrained for the time kWatch at the floor rate, its cause is a longer
///            route and not congestion. The limit of the rate then stays unchanged.
///         3. Without a queue, the rate begins to rise evenly after a waiting time. Each congestion doubles this time,
///            from kPatience up to kMaxPatience.
///         A delay is the difference of two clocks. Only changes of delays are used, so the clocks need not be
///         synchronised.
/// Limits  A queue below kQueue is not detected. Packets that a link with a short queue drops are not detected either.
///         A delay of another cause (a pause of a radio link, other traffic) that lasts longer than kShort is treated
///         as a queue. The rate then falls and recovers within a minute; the displayed force does not change.
/// Source  delay as the sign of a queue: LEDBAT (RFC 6817); rate from arrivals: Cardwell et al., "BBR: congestion-based
///         congestion control", ACM Queue 14(5), 2016. The constants are our choice, and so is the control of a message
///         rate instead of a window, which suits messages that are not repeated
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

  /// In      floor    longest permitted time between two messages; even a slow link must carry this rate
  ///         most_hz  desired rate; the rate is not controlled if this is at most the floor rate
  SendRate(Duration floor, double most_hz) : floor_(floor), most_hz_(most_hz) {}

  /// Returns whether to send a message now; the caller confirms each message by sent().
  bool may_send(Duration now) const noexcept { return now >= due_; }
  void sent(Duration now) noexcept;
  /// Reports the delivery of the message that was sent at time `sent`. `delay` is its arrival time minus its send time;
  /// it contains the constant offset of the two clocks. Messages older than the newest reported one are ignored.
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
  double usual_interval_s_ = 0;         ///< recent mean interval between messages; 0: unknown
  Duration newest_ = Duration::min();   ///< send time of the newest reported message
  Duration calm_at_ = Duration::min();  ///< send time of the last message without a queue
  Duration changed_at_ = Duration::min();
  Duration least_draining_{0};  ///< smallest queueing delay while draining; most_draining_ is the largest one
  Duration most_draining_{0};
  Duration patience_ = kPatience;
  LeastOver recent_{kShort};
  LeastOver usual_{kLong};
};

}  // namespace tandem::net
