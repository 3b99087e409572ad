// Whether a loop keeps its rate: what is computed for a step of a millisecond is wrong when a step takes ten.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/base/time.hpp"

namespace tandem::realtime {

/// Slow is a loop at less than 90 % of its rate for 100 ms: in each of the last two windows fewer ticks came than 90 % of
/// what was due. A single hiccup is in one window only. A window is 50 ms, or 20 periods where that is longer.
///
/// Thread  the loop's own; no allocation after construction
class RateWatch {
 public:
  /// In      period  of the loop; above 0
  explicit RateWatch(Duration period)
      : window_(std::max<Duration>(std::chrono::milliseconds(50), 20 * period)),
        ticks_(2 * static_cast<std::size_t>(window_ * 9 / (period * 10))) {}

  /// Once a tick, at its instant.
  bool is_slow(LocalTime now) noexcept {
    const std::size_t half = ticks_.size() / 2;
    const LocalTime before = ticks_[next_], between = ticks_[(next_ + half) % ticks_.size()];
    const bool is_known = seen_ == ticks_.size();
    ticks_[next_] = now;
    next_ = (next_ + 1) % ticks_.size();
    seen_ = std::min(seen_ + 1, ticks_.size());
    return is_known && now - between > window_ && between - before > window_;
  }
  /// The loop was stopped on purpose.
  void restart() noexcept { seen_ = 0; }

 private:
  Duration window_;
  std::vector<LocalTime> ticks_;  ///< of two windows, a ring
  std::size_t next_ = 0;          ///< the oldest
  std::size_t seen_ = 0;
};

}  // namespace tandem::realtime
