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
/// Longest duration of a session. It limits the memory that a recording needs.
inline constexpr double kMaxSession_s = 4 * 3600.0;

/// Positions and speeds at kMotionRate_hz. Sample i was measured at the time i / kMotionRate_hz [s].
struct HandMotion {
  std::vector<Vec3> p_W;              ///< position of the hand [m]; NaN where it was not measured
  std::vector<double> speed_m_per_s;  ///< speed of the hand; NaN where it was not measured

  double duration_s() const { return static_cast<double>(p_W.size()) / kMotionRate_hz; }
};

/// Collects samples of a hand at any rate and converts them to kMotionRate_hz.
///
/// Model   * Averages: positions and times of the samples in each interval of 10 ms are averaged.
///         * Position: interpolated linearly between two averages, unless they are more than 0.25 s apart (a gap).
///         * Speed: magnitude of the five-point derivative of the position, which is 1 % too small at 10 Hz
/// Cost    40 bytes for each 10 ms
class MotionSampler {
 public:
  /// Adds a sample. A sample is ignored and counted if its position is not finite or farther than 1 km, or if its time
  /// is out of range.
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

/// Motion of the hand between two rests.
struct Movement {
  double begin_s = 0;
  double duration_s = 0;
  double path_m = 0;
  double peak_speed_m_per_s = 0;
  double smoothness = 0;  ///< spectral_arc_length(); NaN if the movement is longer than 60 s
};

/// Returns the movements of a hand. A movement begins when the hand exceeds 5 mm/s. It ends when the hand has been
/// slower than 5 mm/s for 0.2 s, or when a gap begins. Movements shorter than 0.2 s, and those that never reach 20
/// mm/s, are omitted. The smoothness also uses the samples up to 0.1 s before and after the movement.
std::vector<Movement> movements_of(const HandMotion& motion);

/// Returns the length of the path [m] over the samples first ≤ i < last. Gaps add no length.
double path_length_m(const HandMotion& motion, std::size_t first, std::size_t last);

/// Returns a quantile of the values, interpolated linearly between neighbours. NaN values are ignored.
/// In      q  0..1
/// Fails   returns NaN if there are no values
double quantile(std::vector<double> values, double q);

/// Range of motion of a hand: an axis-aligned box in W. Along each axis it extends from percentile 1 to percentile 99
/// of the hand's position, so that short outliers have no effect. Only the first 0.2 s of each rest count. Therefore
/// long rests do not make the range smaller.
struct MotionRange {
  Vec3 low_m = Vec3::Zero();
  Vec3 high_m = Vec3::Zero();
  Vec3 start_m = Vec3::Zero();  ///< median position in the first second

  Vec3 size_m() const { return high_m - low_m; }
  /// Returns the distances from the start to the sides of the box, along −x, +x, −y, +y, −z, +z. A distance is negative
  /// if the start lies outside of that side.
  std::vector<double> reach_m() const;
};

/// Returns the range of motion over the samples first ≤ i < last; none if fewer than 1 s of them are measured.
std::optional<MotionRange> range_of(const HandMotion& motion, std::size_t first, std::size_t last);

}  // namespace tandem::lab
