// Random numbers from an explicit seed. Equal seeds give equal numbers on every machine and with every standard
// library.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace tandem {

/// PCG32 generator (variant XSH-RR) with the distributions that simulated links, simulated hands and tests need.
///
/// Source  O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for Random Number
///         Generation", 2014, §6.3. The distributions are implemented here, because the standard does not specify the
///         exact results of the distributions of <random>
class Random {
 public:
  /// In      seed    seed of the experiment
  ///         stream  number of an independent sequence of this seed (one per link direction, hand, …)
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : increment_((stream << 1U) | 1U) {
    next_u32();
    state_ += seed;
    next_u32();
  }

  std::uint32_t next_u32() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + increment_;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
    const auto rotation = static_cast<std::uint32_t>(old >> 59U);
    return (shifted >> rotation) | (shifted << ((32U - rotation) & 31U));
  }
  std::uint64_t next_u64() {
    const std::uint64_t high = next_u32();
    return (high << 32U) | next_u32();
  }

  /// Returns a uniformly distributed number in [0, 1) with 53 random bits.
  double uniform() { return static_cast<double>(next_u64() >> 11U) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Returns a standard normal deviate by the Box–Muller transform. The second deviate of the pair is discarded, so
  /// that no hidden state is kept.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  /// Returns an exponentially distributed number with the given mean.
  double exponential(double mean) { return -mean * std::log(1.0 - uniform()); }

 private:
  std::uint64_t state_ = 0;
  std::uint64_t increment_;
};

}  // namespace tandem
