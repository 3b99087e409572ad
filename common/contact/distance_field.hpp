// The one question that contact asks of a shape: how far is this point from your surface, and which way is out?
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/spatial.hpp"

namespace tandem::contact {

struct DistanceSample {
  double distance_m = 0;          ///< negative inside
  Vec3 gradient = Vec3::UnitZ();  ///< of the distance: out of the shape; length about 1, less on a crease, never 0
};

/// A place, or a sample, in each row, so that what is done with all of them is done with vectors.
inline constexpr std::size_t kEight = 8;
using EightNumbers = std::array<double, kEight>;
using EightPlaces = Eigen::Array<double, kEight, 3>;
using EightSamples = Eigen::Array<double, kEight, 4>;

inline Vec3 place_at(const EightPlaces& places, std::size_t i) {
  return places.row(static_cast<Eigen::Index>(i)).matrix().transpose();
}
inline void set_sample(EightSamples& samples, std::size_t i, const DistanceSample& sample) {
  samples.row(static_cast<Eigen::Index>(i)) << sample.distance_m, sample.gradient.transpose().array();
}

struct OrientedBox;

/// A part of a surface is flat: distance = normal·p + offset.
struct FieldPlane {
  Vec3 normal = Vec3::UnitZ();  ///< unit, out of the shape
  double offset_m = 0;

  double distance_m(const Vec3& p) const { return normal.dot(p) + offset_m; }
};
/// Of a field's planes, a bit each.
using PlaneSet = std::uint64_t;
inline constexpr std::size_t kMaxPlanes = 64;
/// A surface whose normal is as near to a plane's lies along it.
inline constexpr double kOnPlaneCosine = 0.999;

/// Signed distance to the surface of a shape, in the frame of the shape S.
///
/// Thread  any, at the same time; no allocation, no throw, finite for finite points
class DistanceField {
 public:
  virtual ~DistanceField() = default;

  /// Right to `error_m()` where |distance| ≤ `band_m()`. Beyond, of the right sign and never farther from zero than the
  /// true distance plus `error_m()`: good for culling.
  virtual double distance_m(const Vec3& p_S) const noexcept = 0;
  /// The same distance with its gradient.
  virtual DistanceSample sample(const Vec3& p_S) const noexcept = 0;
  /// sample() of `count` places; faster together.
  ///
  /// In      p_S      a place in each row
  /// Out     samples  likewise: distance, gradient; of other rows anything
  virtual void sample_all(const EightPlaces& p_S, std::size_t count, EightSamples& samples) const noexcept {
    for (std::size_t i = 0; i < count; ++i) set_sample(samples, i, sample(place_at(p_S, i)));
  }

  /// distance_m() of `count` places; faster together.
  ///
  /// In      p_S          a place in each row
  /// Out     distances_m  of other rows anything
  virtual void distances_m(const EightPlaces& p_S, std::size_t count, EightNumbers& distances_m) const noexcept {
    for (std::size_t i = 0; i < count; ++i) distances_m[i] = distance_m(place_at(p_S, i));
  }

  /// The planes of its flat parts, kMaxPlanes at most; they live as long as the field.
  virtual std::span<const FieldPlane> planes() const noexcept { return {}; }
  /// Those whose largest distance is the field's all over a box, where it is not positive: a face, or where faces meet
  /// at a convex edge or corner. Where it is positive, so is the field's, and not less. Within what samples are rounded
  /// to. Six at most; none: it is not so, or not known.
  ///
  /// Out     looks  more by as many places as it looked at
  virtual PlaneSet planes_over(const OrientedBox& /*box_S*/, std::size_t& looks) const noexcept {
    ++looks;
    return 0;
  }

  /// The same at one place; faster.
  virtual PlaneSet planes_at(const Vec3& /*p_S*/) const noexcept { return 0; }

  virtual double error_m() const noexcept = 0;
  virtual double band_m() const noexcept = 0;
};

}  // namespace tandem::contact
