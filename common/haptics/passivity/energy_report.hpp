// Energies received as non-decreasing sums: a lost report does no harm, and the harm of a false one is bounded.
#pragma once

#include <cstdint>
#include <limits>

namespace tandem::haptics {

/// Reads two running sums of a peer, one for each direction of energy flow, and returns the net change since the last
/// report.
///
/// Fails   A report with a number that is negative, not finite or smaller than before is dropped entirely and counted.
///         Inflow is limited to `max_power_w` over time, with a burst of one second: reports that arrive in a bunch
///         count fully within it, false ones accumulate no faster. Where the peer's possible work is known, it limits
///         the inflow too. Inflow above either limit is lost. Outflow counts in full.
/// Thread  haptic or room: no allocation, no throw
class EnergyReport {
 public:
  /// Ten times the power of a hand at 6.5 N and 0.3 m/s.
  static constexpr double kMaxPower_w = 20.0;
  explicit EnergyReport(double max_power_w = kMaxPower_w) : max_power_w_(max_power_w) {}

  /// Returns inflow less outflow since the last report [J]. The first report only sets the reference.
  /// In      could_do_j  upper bound of the inflow since then; an unclaimed rest may be claimed later, up to
  ///         kMaxUnclaimed_j
  double accept(double in_j, double out_j, double elapsed_s,
                double could_do_j = std::numeric_limits<double>::infinity()) noexcept;
  /// Bound of the unclaimed work. A hand that is measured smoothly reports its work some milliseconds late.
  static constexpr double kMaxUnclaimed_j = 0.1;
  std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  static constexpr double kMaxAtOnce_s = 1.0;

  double max_power_w_;
  bool has_report_ = false;
  double unused_s_ = kMaxAtOnce_s;  ///< unused time of max_power_w_
  double in_j_ = 0;
  double out_j_ = 0;
  double unclaimed_j_ = kMaxUnclaimed_j;
  std::uint64_t dropped_ = 0;
};

}  // namespace tandem::haptics
