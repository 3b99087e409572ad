// Rate limit with an average rate and a burst size.
#pragma once

#include <algorithm>

#include "common/base/time.hpp"

namespace tandem::net {

struct Rate {
  double per_second = 0;
  double at_once = 0;
};

/// Token bucket with a capacity of `at_once` tokens. It starts full and fills at the rate `per_second`. The balance may
/// become negative, down to minus the larger of at_once and the cost of one item. If no item costs more than at_once,
/// the balance is therefore at least zero after a pause of at_once / per_second.
///
/// Thread  any, one at a time; no allocation
class TokenBucket {
 public:
  explicit TokenBucket(Rate rate) : rate_(rate), tokens_(rate.at_once) {}

  /// Returns whether the balance is positive. The next item may cost more than the balance.
  bool has_some(LocalTime now) const { return tokens_at(now) > 0; }
  bool is_full(LocalTime now) const { return tokens_at(now) >= rate_.at_once; }
  /// If the balance covers `cost`, removes `cost` tokens and returns true. Otherwise returns false and removes nothing,
  /// so a user whose requests are refused still gets the allowed rate.
  bool try_consume(double cost, LocalTime now) { return tokens_at(now) >= cost && consume(cost, now); }
  /// Removes `cost` tokens, even if the balance does not cover them. Returns whether it covered them.
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
