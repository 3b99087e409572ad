// Energies that come over the wire as sums that only grow: a lost report does no harm, and a false one a bounded one.
#pragma once

#include <cstdint>

namespace tandem::haptics {

/// Takes two running sums of a peer, what flowed one way and what the other, and gives the net change since the last.
///
/// Fails   a report with a number that is negative, not finite or smaller than before is dropped whole, and counted.
///         What flowed in counts at most as `power_limit_w` allows over time, a second of it at once, so a peer that
///         makes energy up is believed no faster than that, and reports that bunch are whole; what is cut is lost to
///         it. What flowed out counts in full.
/// Thread  haptic or room: no allocation, no throw
class EnergyReport {
 public:
  explicit EnergyReport(double power_limit_w) : power_limit_w_(power_limit_w) {}

  /// What flowed in less what flowed out since the last report [J]. The first one only sets where to count from.
  double take(double in_j, double out_j, double elapsed_s) noexcept;
  void reset() noexcept { *this = EnergyReport(power_limit_w_); }
  std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  static constexpr double kMaxAtOnce_s = 1.0;

  double power_limit_w_;
  bool has_report_ = false;
  double believed_s_ = kMaxAtOnce_s;  ///< of power_limit_w_, not yet used
  double in_j_ = 0;
  double out_j_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace tandem::haptics
