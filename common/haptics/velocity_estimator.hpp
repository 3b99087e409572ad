// Estimates the velocity of a handle whose position is quantized. A difference over one period would be too noisy: a
// step of 0.03 mm in 1 ms appears as 30 mm/s.
#pragma once

#include <array>
#include <cstddef>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::haptics {

/// First-order adaptive windowing: uses the longest window in which the positions lie on a line within their
/// resolution. The window is long at rest (little noise), and short when the direction of motion changes (little
/// delay).
///
/// Source  Janabi-Sharifi, Hayward, Chen, "Discrete-time adaptive windowing for velocity estimation", IEEE T-CST
///         8(6), 2000
/// Thread  haptic: no allocation, no throw
class VelocityEstimator {
 public:
  static constexpr std::size_t kMaxSamples = 32;
  static constexpr std::size_t kWindow = 20;
  /// In      …_step_…  resolution of the positions; 0: exact positions, with a window of one period
  ///         window    longest window [periods], below kMaxSamples
  explicit VelocityEstimator(double position_step_m = 0, double rotation_step_rad = 0, std::size_t window = kWindow);

  /// Adds a sample and returns the velocity. A sample that is not finite, or not newer than the previous one, is
  /// ignored.
  Twist add(LocalTime taken, const Pose& X) noexcept;
  void reset() noexcept;

  /// Delay of the last estimate: half of its window.
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
