// Minimum over a sliding time window, computed without storing the values.
#pragma once

#include <algorithm>

#include "common/base/time.hpp"

namespace tandem::net {

/// Approximate sliding minimum in constant memory. The result covers the newest values over a time that varies between
/// half of the given span and the whole span.
///
/// Thread  any, one at a time; no allocation
class LeastOver {
 public:
  explicit LeastOver(Duration span) : half_(span / 2) {}

  /// In      at  time of the value; must not decrease
  void add(Duration at, Duration value) noexcept {
    if (began_ == Duration::min()) began_ = at;
    if (at - began_ >= half_) {
      before_ = at - began_ >= 2 * half_ ? Duration::max() : current_;
      current_ = Duration::max();
      began_ = at;
    }
    current_ = std::min(current_, value);
  }
  /// Returns the minimum; Duration::max() if no value was added.
  Duration least() const noexcept { return std::min(current_, before_); }

 private:
  Duration half_;
  Duration began_ = Duration::min();
  Duration current_ = Duration::max();
  Duration before_ = Duration::max();
};

}  // namespace tandem::net
