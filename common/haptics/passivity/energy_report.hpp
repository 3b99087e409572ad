// Reads energy reports of a peer, which are non-decreasing sums. A lost report does no harm, and a false report does
// only bounded harm.
#pragma once

#include <cstdint>
#include <limits>

namespace tandem::haptics {

/// Converts a peer's running sums of inflow and outflow to the net energy since the last report.
///
/// Fails   A report is rejected as a whole and counted if a sum is negative, not finite or smaller than before. Outflow
///         is accepted in full. Inflow above one of two limits is discarded:
///         1. mean power: at most `max_power_w`, with a burst of one second. Reports that arrive together are accepted
///            in full within the burst.
///         2. possible work: at most `could_do_j`, an upper bound of the peer's work, if that is known.
/// Thread  haptic or room: no allocation, no throw
class EnergyReport {
 public:
  /// Default limit of the mean inflow: ten times the power of a hand that exerts 6.5 N at 0.3 m/s.
  static constexpr double kMaxPower_w = 20.0;
  explicit EnergyReport(double max_power_w = kMaxPower_w) : max_power_w_(max_power_w) {}

  /// Returns inflow less outflow since the last report [J]. The first report only sets the reference.
  /// In      could_do_j  upper bound of the inflow since the last report. The part that the peer did not report as
  ///         inflow is kept for later reports, up to kMaxUnclaimed_j
  double accept(double in_j, double out_j, double elapsed_s,
                double could_do_j = std::numeric_limits<double>::infinity()) noexcept;
  /// Largest possible work that is kept for later reports. It is kept because a client that smooths its measured motion
  /// reports its work some milliseconds late.
  static constexpr double kMaxUnclaimed_j = 0.1;
  std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  static constexpr double kMaxAtOnce_s = 1.0;

  double max_power_w_;
  bool has_report_ = false;
  /// Time for which inflow at max_power_w may still be accepted at once, at most the burst.
  double unused_s_ = kMaxAtOnce_s;
  double in_j_ = 0;
  double out_j_ = 0;
  double unclaimed_j_ = kMaxUnclaimed_j;
  std::uint64_t dropped_ = 0;
};

}  // namespace tandem::haptics
