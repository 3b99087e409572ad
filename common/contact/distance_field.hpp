// The one question that contact asks of a shape: how far is this point from your surface, and which way is out?
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::contact {

struct DistanceSample {
  double distance_m = 0;          ///< negative inside
  Vec3 gradient = Vec3::UnitZ();  ///< of the distance: out of the shape; length about 1, never 0
};

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

  virtual double error_m() const noexcept = 0;
  virtual double band_m() const noexcept = 0;
};

}  // namespace tandem::contact
