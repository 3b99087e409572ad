// Energies that come over the wire as sums that only grow: a lost report does no harm, and a false one a bounded one.
#pragma once

#include <cstdint>
#include <limits>

namespace tandem::haptics {

/// Takes two running sums of a peer, energy that flowed one way and the other, and gives the net change since the last
/// report.
///
/// Fails   a report with a number that is negative, not finite or smaller than before is dropped whole, and counted.
///         What flowed in counts at most at `max_power_w` over time, a second of it at once: reports that arrive in a
///         bunch count whole within that, false ones no faster; and only what the peer could have done, where that is
///         known. What is above either limit is lost. What flowed out counts in full.
/// Thread  haptic or room: no allocation, no throw
class EnergyReport {
 public:
  /// Ten times what a hand does at 6.5 N and 0.3 m/s.
  static constexpr double kMaxPower_w = 20.0;
  explicit EnergyReport(double max_power_w = kMaxPower_w) : max_power_w_(max_power_w) {}

  /// What flowed in less what flowed out since the last report [J]. The first one only sets where to count from.
  /// In      could_do_j  the most that can have flowed in since then; what is not claimed of it, may be later, up to
  ///                     kMaxUnclaimed_j
  double take(double in_j, double out_j, double elapsed_s,
              double could_do_j = std::numeric_limits<double>::infinity()) noexcept;
  /// A hand that is measured smoothly claims its work some milliseconds late.
  static constexpr double kMaxUnclaimed_j = 0.1;
  std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  static constexpr double kMaxAtOnce_s = 1.0;

  double max_power_w_;
  bool has_report_ = false;
  double unused_s_ = kMaxAtOnce_s;  ///< of max_power_w_
  double in_j_ = 0;
  double out_j_ = 0;
  double unclaimed_j_ = kMaxUnclaimed_j;
  std::uint64_t dropped_ = 0;
};

}  // namespace tandem::haptics
