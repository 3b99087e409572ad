// Signed distance from a shape's surface to a point, with the outward direction. Contact uses a shape only through this
// query.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/spatial.hpp"

namespace tandem::contact {

struct DistanceSample {
  double distance_m = 0;  ///< negative for a point inside the shape
  /// Gradient of the distance, pointing out of the shape. Its length is about 1. It is less on a crease (where two
  /// sides are equally near), and never 0.
  Vec3 gradient = Vec3::UnitZ();
};

/// Eight positions or samples, one in each row, so that operations on all of them are vectorised.
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

/// Flat part of a surface: distance = normal·p + offset.
struct FieldPlane {
  Vec3 normal = Vec3::UnitZ();  ///< unit vector out of the shape
  double offset_m = 0;

  double distance_m(const Vec3& p) const { return normal.dot(p) + offset_m; }
};
/// Set of a field's planes, one bit each.
using PlaneSet = std::uint64_t;
inline constexpr std::size_t kMaxPlanes = 64;
/// A surface belongs to a plane only if the cosine of the angle between their normals is at least this value.
inline constexpr double kOnPlaneCosine = 0.999;

/// Signed distance to the surface of a shape, in the frame of the shape S.
///
/// Thread  any number of threads at the same time; no allocation, no throw, finite for finite points
class DistanceField {
 public:
  virtual ~DistanceField() = default;

  /// Returns the signed distance. Where |distance| ≤ `band_m()`, it is accurate to `error_m()`. Farther from the
  /// surface, the sign is right, and the magnitude is at most the true distance plus `error_m()`. This suffices for
  /// culling.
  virtual double distance_m(const Vec3& p_S) const noexcept = 0;
  /// Returns the distance and its gradient.
  virtual DistanceSample sample(const Vec3& p_S) const noexcept = 0;
  /// Does the same as sample() for `count` points, faster than separate calls.
  ///
  /// In      p_S      one point in each row
  /// Out     samples  distance and gradient in each row; rows from `count` on are undefined
  virtual void sample_all(const EightPlaces& p_S, std::size_t count, EightSamples& samples) const noexcept {
    for (std::size_t i = 0; i < count; ++i) set_sample(samples, i, sample(place_at(p_S, i)));
  }

  /// Does the same as distance_m() for `count` points, faster than separate calls.
  ///
  /// In      p_S          one point in each row
  /// Out     distances_m  entries from `count` on are undefined
  virtual void distances_m(const EightPlaces& p_S, std::size_t count, EightNumbers& distances_m) const noexcept {
    for (std::size_t i = 0; i < count; ++i) distances_m[i] = distance_m(place_at(p_S, i));
  }

  /// Returns the planes of the shape's flat parts, kMaxPlanes at most. They live as long as the field.
  virtual std::span<const FieldPlane> planes() const noexcept { return {}; }
  /// Returns the planes that can replace the field in a box: the plane of a face, or those of faces that meet at a
  /// convex edge or corner. There are at most six; the set is empty if no such planes are known. Within the rounding of
  /// samples:
  /// * inside the shape, the field's distance equals the largest distance to the planes
  /// * elsewhere, the field's distance is at least that largest distance
  ///
  /// Out     queries  increased by the number of entries that were read from the field's table of planes
  virtual PlaneSet planes_over(const OrientedBox& /*box_S*/, std::size_t& queries) const noexcept {
    ++queries;
    return 0;
  }

  /// Does the same as planes_over() for one point, faster.
  virtual PlaneSet planes_at(const Vec3& /*p_S*/) const noexcept { return 0; }

  virtual double error_m() const noexcept = 0;
  virtual double band_m() const noexcept = 0;
};

}  // namespace tandem::contact
