#include "common/net/send_rate.hpp"

namespace tandem::net {

Duration SendRate::interval() const noexcept {
  if (is_draining_) return floor_;
  return limit_hz_ < kUnlimited ? std::min(floor_, from_seconds(1 / limit_hz_)) : Duration{0};
}

void SendRate::sent(Duration now) noexcept {
  constexpr double kMemory_s = 0.1;
  if (last_sent_ != Duration::min()) {
    const double since_s = std::max(0.0, to_seconds(now - last_sent_));
    const double weight = usual_interval_s_ > 0 ? std::min(1.0, since_s / kMemory_s) : 1.0;
    usual_interval_s_ += weight * (since_s - usual_interval_s_);
  }
  last_sent_ = now;
  // A message that is late by less than one interval does not shift the following ones: the next interval then begins
  // at the time when the late message was due. A coarse clock therefore does not reduce the mean rate.
  const Duration interval = this->interval();
  due_ = due_ == Duration::min() ? now + interval : std::max(due_ + interval, now);
}

void SendRate::delivered(Duration sent, Duration delay) noexcept {
  const bool is_news = sent > newest_ && sent <= last_sent_;
  if (!is_news || most_hz_ * to_seconds(floor_) <= 1) return;
  const Duration since_last = newest_ == Duration::min() ? Duration{0} : sent - newest_;
  newest_ = sent;
  if (changed_at_ == Duration::min()) changed_at_ = calm_at_ = sent;
  recent_.add(sent, delay);
  usual_.add(sent, delay);
  const Duration queue = recent_.least() - usual_.least();
  if (is_draining_) return drain(sent, queue);
  if (queue < kDrained) calm_at_ = sent;
  if (queue > kQueue && sent > changed_at_) return fall(sent, queue);
  rise(sent, since_last);
}

void SendRate::fall(Duration sent, Duration queue) noexcept {
  const double grown_in_s = std::max(1e-3, to_seconds(sent - calm_at_));
  const double rate_hz = usual_interval_s_ > 0 ? 1 / usual_interval_s_ : most_hz_;
  const double carried_hz = rate_hz / (1 + to_seconds(queue) / grown_in_s);
  resume_hz_ = std::max(1 / to_seconds(floor_), kMargin * carried_hz);
  is_draining_ = true;
  least_draining_ = Duration::max();
  most_draining_ = Duration::min();
  // The new rate affects only messages that are sent after this time.
  changed_at_ = std::max(sent, last_sent_);
  due_ = std::max(due_, last_sent_ + floor_);
}

void SendRate::drain(Duration sent, Duration queue) noexcept {
  if (sent <= changed_at_) return;
  const bool is_drained = queue < kDrained;
  least_draining_ = std::min(least_draining_, queue);
  most_draining_ = std::max(most_draining_, queue);
  const bool is_no_queue = sent - changed_at_ >= kWatch && most_draining_ - least_draining_ < 2 * kDrained;
  if (!is_drained && !is_no_queue) return;
  if (is_drained) {
    limit_hz_ = resume_hz_;
    patience_ = std::min(2 * patience_, kMaxPatience);
  } else {
    forget_delays();
  }
  is_draining_ = false;
  changed_at_ = calm_at_ = sent;
}

void SendRate::rise(Duration sent, Duration since_last) noexcept {
  if (limit_hz_ == kUnlimited || sent - changed_at_ < patience_) return;
  limit_hz_ *= 1 + kRise_per_s * to_seconds(since_last);
  if (limit_hz_ <= most_hz_) return;
  limit_hz_ = kUnlimited;
  patience_ = kPatience;
}

void SendRate::forget_delays() noexcept {
  recent_ = LeastOver(kShort);
  usual_ = LeastOver(kLong);
}

}  // namespace tandem::net
