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
/// Model   Position: the samples of each interval of 10 ms are averaged, and so are their times. Between two averages
///         the position is interpolated linearly. A gap of more than 0.25 s is not filled. Speed: magnitude of the
///         five-point derivative. Its gain is 1 % too low at 10 Hz
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

/// Returns the movements of a hand. A movement reaches 20 mm/s and lasts 0.2 s or more. It ends when the hand has been
/// slower than 5 mm/s for 0.2 s, or when the hand is not measured. The smoothness includes up to 0.1 s before and after
/// the movement.
std::vector<Movement> movements_of(const HandMotion& motion);

/// Returns the length of the path [m] over the samples first ≤ i < last. Gaps add no length.
double path_length_m(const HandMotion& motion, std::size_t first, std::size_t last);

/// Returns a quantile of the values, interpolated linearly between neighbours. NaN values are ignored.
/// In      q  0..1
/// Fails   returns NaN if there are no values
double quantile(std::vector<double> values, double q);

/// Axis-aligned box in W. Along each axis it extends from percentile 1 to percentile 99 of the hand's position, so
/// short outliers have no effect. Of each rest, only the first 0.2 s are included. A session with long rests therefore
/// has the same range as one without.
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
