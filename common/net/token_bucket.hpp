// Rate limit with an average rate and a burst size.
#pragma once

#include <algorithm>

#include "common/base/time.hpp"

namespace tandem::net {

struct Rate {
  double per_second = 0;
  double at_once = 0;
};

/// Token bucket of `at_once` tokens, which starts full and fills at `per_second`. The balance may become negative: its
/// lower limit is minus the larger of at_once and the cost of one item. If no item costs more than at_once, a pause of
/// at_once / per_second therefore restores a balance of at least zero.
///
/// Thread  any, one at a time; no allocation
class TokenBucket {
 public:
  explicit TokenBucket(Rate rate) : rate_(rate), tokens_(rate.at_once) {}

  /// Returns true while the balance is positive; the next item may cost more than the balance.
  bool has_some(LocalTime now) const { return tokens_at(now) > 0; }
  bool is_full(LocalTime now) const { return tokens_at(now) >= rate_.at_once; }
  /// Removes `cost` tokens if the balance covers them, and returns whether it did. A refused request costs nothing, so
  /// a user who requests too often still gets the allowed rate.
  bool try_consume(double cost, LocalTime now) { return tokens_at(now) >= cost && consume(cost, now); }
  /// Removes `cost` tokens; returns whether the balance covered them.
  bool consume(double cost, LocalTime now) {
    const double left = tokens_at(now) - cost;
    tokens_ = std::max(left, -std::max(rate_.at_once, cost));
    at_ = now;
    return left >= 0;
  }

 private:
  double tokens_at(LocalTime now) const {
    if (at_ == LocalTime{}) return tokens_;
    return std::min(rate_.at_once, tokens_ + rate_.per_second * to_seconds(now - at_));
  }

  Rate rate_;
  double tokens_;
  LocalTime at_{};  ///< time for which `tokens_` is valid
};

}  // namespace tandem::net
