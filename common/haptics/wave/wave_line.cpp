#include "common/haptics/wave/wave_line.hpp"

#include <algorithm>

namespace tandem::haptics {
namespace {

double wrapped(double value) {
  return std::isfinite(value) ? value - 2 * kWaveSumRange * std::floor(value / (2 * kWaveSumRange) + 0.5) : 0.0;
}

Wave wrapped(const Wave& wave) {
  Wave result;
  for (int i = 0; i < 3; ++i) {
    result.f[i] = wrapped(wave.f[i]);
    result.t[i] = wrapped(wave.t[i]);
  }
  return result;
}

}  // namespace

Wave wave_sum(const Wave& sum_before, const Wave& wave, double period_s) noexcept {
  return is_finite(wave) && std::isfinite(period_s) ? wrapped(sum_before + wave * period_s) : sum_before;
}

Wave wave_difference(const Wave& b, const Wave& a) noexcept {
  return wrapped(b - a);
}

void WavePlayer::receive(Duration sender_time, const Wave& sum) noexcept {
  if (!is_finite(sum)) return;
  const double gap_s = to_seconds(sender_time - newest_);
  if (has_received_ && gap_s <= 0) return;
  if (has_received_ && gap_s <= settings_.longest_gap_s) {
    const Wave mean = wave_difference(sum, received_) * (1 / gap_s);
    if (squared(mean) <= settings_.limit_sqrt_w * settings_.limit_sqrt_w) append({mean, gap_s});
  }
  has_received_ = true;
  newest_ = sender_time;
  received_ = sum;
}

void WavePlayer::append(const Stretch& stretch) noexcept {
  if (waiting_s_ + stretch.left_s > kMaxWaiting_s) {
    count_ = 0;
    waiting_s_ = 0;
  }
  waiting_s_ += stretch.left_s;
  if (count_ < kMaxStretches) {
    stretches_[(first_ + count_++) % kMaxStretches] = stretch;
    return;
  }
  Stretch& last = stretches_[(first_ + count_ - 1) % kMaxStretches];
  const double both_s = last.left_s + stretch.left_s;
  last.wave = (last.wave * last.left_s + stretch.wave * stretch.left_s) * (1 / both_s);
  last.left_s = both_s;
}

Wave WavePlayer::play(double period_s) noexcept {
  if (!(period_s > 0) || !std::isfinite(period_s)) return {};
  watch_waiting(period_s);
  const double share = -std::expm1(-period_s / settings_.smoothing_s);
  filtered_ = filtered_ * (1 - share) + next(period_s) * share;
  return filtered_;
}

// Returns the mean of the queued wave over the period. If the queue is shorter than the period, the rest counts as 0.
Wave WavePlayer::next(double period_s) noexcept {
  const double skipped_s = std::min(surplus_s_, settings_.skipped_share * period_s);
  surplus_s_ -= skipped_s;
  double wanted_s = period_s + skipped_s;
  const double stretch_of_time = wanted_s;
  Wave sum;
  while (count_ > 0 && wanted_s > 0) {
    Stretch& front = stretches_[first_];
    const double taken_s = std::min(front.left_s, wanted_s);
    sum += front.wave * taken_s;
    wanted_s -= taken_s;
    waiting_s_ = std::max(0.0, waiting_s_ - taken_s);
    front.left_s -= taken_s;
    // A remainder below this value is a rounding error, because the times are sums of a few periods.
    if (front.left_s > 1e-12) continue;
    first_ = (first_ + 1) % kMaxStretches;
    --count_;
  }
  return sum * (1 / stretch_of_time);
}

void WavePlayer::watch_waiting(double period_s) noexcept {
  least_waiting_s_ = watched_s_ > 0 ? std::min(least_waiting_s_, waiting_s_) : waiting_s_;
  watched_s_ += period_s;
  if (watched_s_ < kWatched_s) return;
  surplus_s_ = std::max(0.0, least_waiting_s_ - period_s - settings_.margin_s);
  watched_s_ = 0;
}

}  // namespace tandem::haptics
