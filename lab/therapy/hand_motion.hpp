// Motion of a hand at a constant rate, and the movements in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::lab {

/// Rate to which the inputs of a hand are converted. Smoothness uses frequencies up to 10 Hz.
inline constexpr double kMotionRate_hz = 100;
/// Longest session. Limits the memory for a recording.
inline constexpr double kMaxSession_s = 4 * 3600.0;

/// Positions at kMotionRate_hz; sample i was at i / kMotionRate_hz [s].
struct HandMotion {
  std::vector<Vec3> p_W;              ///< [m]; NaN where the hand was not measured
  std::vector<double> speed_m_per_s;  ///< NaN where the hand was not measured

  double duration_s() const { return static_cast<double>(p_W.size()) / kMotionRate_hz; }
};

/// Collects samples of a hand at any rate and converts them to kMotionRate_hz.
///
/// Model   The samples of each 10 ms are averaged, with their times. Between the averages the position is linear; a gap
///         of more than 0.25 s stays a gap. Speed: magnitude of the five-point derivative. Its gain is 1 % too low at
///         10 Hz
/// Cost    40 bytes for each 10 ms
class MotionSampler {
 public:
  /// Adds a sample. One whose position is not finite or beyond 1 km, or whose time is out of range, is ignored and
  /// counted.
  /// In      at_s  0..kMaxSession_s, in any order
  void add(double at_s, const Vec3& p_W);
  HandMotion motion() const;
  bool is_empty() const { return intervals_.empty(); }
  std::uint64_t ignored() const { return ignored_; }

 private:
  struct Interval {
    Vec3 sum = Vec3::Zero();
    double time_sum_s = 0;
    std::uint32_t count = 0;
  };
  std::vector<Interval> intervals_;
  std::uint64_t ignored_ = 0;
};

/// Motion between two rests.
struct Movement {
  double begin_s = 0;
  double duration_s = 0;
  double path_m = 0;
  double peak_speed_m_per_s = 0;
  double smoothness = 0;  ///< spectral_arc_length(); NaN if the movement is longer than 60 s
};

/// Finds the movements of a hand. A movement exceeds 20 mm/s, lasts 0.2 s or more, and ends when the hand has been slower
/// than 5 mm/s for 0.2 s, or was not measured. The smoothness includes up to 0.1 s before and after.
std::vector<Movement> movements_of(const HandMotion& motion);

/// Length of the path [m] of the samples first ≤ i < last. Gaps do not count.
double path_length_m(const HandMotion& motion, std::size_t first, std::size_t last);

/// Quantile of values, with linear interpolation between neighbours. NaN values do not count.
/// In      q  0..1
/// Fails   returns NaN if there are no values
double quantile(std::vector<double> values, double q);

/// Axis-aligned box in W that contains the hand for 98 % of the time along each axis: percentiles 1 and 99. Short
/// outliers therefore do not count. Of a rest only the first 0.2 s count, so that a session with long rests has the same
/// range.
struct MotionRange {
  Vec3 low_m = Vec3::Zero();
  Vec3 high_m = Vec3::Zero();
  Vec3 start_m = Vec3::Zero();  ///< median position in the first second

  Vec3 size_m() const { return high_m - low_m; }
  /// Distance from the start to the limits of the box, along −x, +x, −y, +y, −z, +z. It is negative if the start is
  /// outside.
  std::vector<double> reach_m() const;
};

/// Returns the range of the samples first ≤ i < last; none if fewer than 1 s of them are measured.
std::optional<MotionRange> range_of(const HandMotion& motion, std::size_t first, std::size_t last);

}  // namespace tandem::lab
