// Velocity of a handle whose position comes in steps: over one period a step of 0.03 mm is 30 mm/s of noise.
#pragma once

#include <array>
#include <cstddef>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::haptics {

/// First-order adaptive windowing: the longest window over which the positions still lie on a line to within their
/// resolution. Long at rest (quiet), short when the hand turns (prompt).
///
/// Source  Janabi-Sharifi, Hayward, Chen, "Discrete-time adaptive windowing for velocity estimation", IEEE T-CST
///         8(6), 2000
/// Thread  haptic: no allocation, no throw
class VelocityEstimator {
 public:
  static constexpr std::size_t kMaxSamples = 32;
  static constexpr std::size_t kWindow = 20;
  /// In      …_step_…  resolution; 0: exact positions, the window is one period
  ///         window    most periods, below kMaxSamples
  explicit VelocityEstimator(double position_step_m = 0, double rotation_step_rad = 0, std::size_t window = kWindow);

  /// Takes a sample and gives the velocity. A sample that is not newer than the last, or not finite, changes nothing.
  Twist add(LocalTime taken, const Pose& X) noexcept;
  void reset() noexcept;

  /// By how much the last estimate is late: half its window.
  Duration linear_delay() const noexcept;
  Duration angular_delay() const noexcept;

 private:
  struct Sample {
    LocalTime taken{};
    Pose X;
  };
  double position_step_m_;
  double rotation_step_rad_;
  std::size_t window_;
  std::array<Sample, kMaxSamples> samples_{};
  std::size_t count_ = 0;
  std::size_t newest_ = 0;
  Twist twist_;
  Duration linear_delay_{0};
  Duration angular_delay_{0};
};

}  // namespace tandem::haptics
