// See force_blend.hpp.
#include "client/haptics/stages/force_blend.hpp"

#include <cmath>

namespace tandem::client {

void ForceBlend::jump(const Wrench& from, const Wrench& to) noexcept {
  const Wrench offset = offset_ + (from - to);
  if (is_finite(offset)) offset_ = offset;
}

// o(t) = e^(−ωt) (o (1 + ωt) + ȯ t),  ȯ(t) = e^(−ωt) (ȯ (1 − ωt) − ω² t o)
void ForceBlend::advance(double period_s) noexcept {
  const double turned = kRate * period_s;
  if (!(turned > 0) || !std::isfinite(turned)) return;
  const double left = std::exp(-turned);
  const Wrench offset = (offset_ * (1 + turned) + slope_ * period_s) * left;
  slope_ = (slope_ * (1 - turned) - offset_ * (kRate * turned)) * left;
  offset_ = offset;
}

}  // namespace tandem::client
