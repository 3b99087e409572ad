#include "client/haptics/stages/force_blend.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

/// Shortens `offset` when the target moves in its direction: subtracts the component of the target's motion `way` along
/// `offset`, down to zero. Scales `slope` by the same factor.
void give_way(const Vec3& way, Vec3& offset, Vec3& slope) {
  const double length = offset.norm();
  const double along = length > 0 ? way.dot(offset) / length : 0.0;
  if (!(along > 0)) return;
  const double left = std::max(0.0, 1 - along / length);
  offset *= left;
  slope *= left;
}

}  // namespace

// Advances offset and slope by the exact solution of the differential equation in the header:
// o(t) = e^(−ωt) (o (1 + ωt) + ȯ t),  ȯ(t) = e^(−ωt) (ȯ (1 − ωt) − ω² t o)
void ForceBlend::advance(double period_s) noexcept {
  const double turned = rate_per_s_ * period_s;
  if (!(turned > 0) || !std::isfinite(turned)) return;
  const double left = std::exp(-turned);
  const Wrench offset = (offset_ * (1 + turned) + slope_ * period_s) * left;
  slope_ = (slope_ * (1 - turned) - offset_ * (rate_per_s_ * turned)) * left;
  offset_ = offset;
}

Wrench ForceBlend::apply(const Wrench& target) noexcept {
  if (!is_finite(target)) return target;
  const Wrench way = target - target_;
  target_ = target;
  if (jumps_) {
    offset_ = offset_ - way;
  } else {
    give_way(way.f, offset_.f, slope_.f);
    give_way(way.t, offset_.t, slope_.t);
  }
  jumps_ = false;
  return target + offset_;
}

}  // namespace tandem::client
