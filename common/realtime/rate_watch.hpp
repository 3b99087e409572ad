// Detects a loop that runs too slowly: results computed for steps of 1 ms are wrong if a step takes 10 ms.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/base/time.hpp"

namespace tandem::realtime {

/// Watches the rate of a loop. The loop is slow if it ran fewer than 90 % of its ticks in each of the last two windows.
/// A window lasts 50 ms, or 20 periods if that is longer. Two windows are required, because a single delay, which is no
/// fault, affects only one.
///
/// Thread  the thread of the loop; no allocation after construction
class RateWatch {
 public:
  /// In      period  period of the loop, > 0
  explicit RateWatch(Duration period)
      : window_(std::max<Duration>(std::chrono::milliseconds(50), 20 * period)),
        ticks_(2 * static_cast<std::size_t>(window_ * 9 / (period * 10))) {}

  /// Returns whether the loop is slow. Call it once per tick, with the time of the tick.
  bool is_slow(LocalTime now) noexcept {
    const std::size_t half = ticks_.size() / 2;
    const LocalTime before = ticks_[next_], between = ticks_[(next_ + half) % ticks_.size()];
    const bool is_known = seen_ == ticks_.size();
    ticks_[next_] = now;
    next_ = (next_ + 1) % ticks_.size();
    seen_ = std::min(seen_ + 1, ticks_.size());
    return is_known && now - between > window_ && between - before > window_;
  }
  /// Discards the recorded ticks; call it after the loop was stopped intentionally.
  void restart() noexcept { seen_ = 0; }

 private:
  Duration window_;
  std::vector<LocalTime> ticks_;  ///< ring buffer of tick times; each half has 90 % of the ticks of a window
  std::size_t next_ = 0;          ///< index of the oldest tick
  std::size_t seen_ = 0;
};

}  // namespace tandem::realtime
