// See force_blend.hpp.
#include "client/haptics/stages/force_blend.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

/// A jump by less is none: what comes next should not wait for it.
constexpr double kUnfelt_n = 0.02, kUnfelt_n_m = 0.0005;

}  // namespace

void ForceBlend::jump() noexcept {
  held_ = shown_;
  turned_ = 0;
}

void ForceBlend::advance(double period_s) noexcept {
  const double turned = kRate * period_s;
  if (turned > 0 && std::isfinite(turned)) turned_ = std::min(turned_ + turned, kLong);
}

double ForceBlend::share() const noexcept {
  return turned_ < kLong ? (1 + turned_) * std::exp(-turned_) : 0.0;
}

Wrench ForceBlend::apply(const Wrench& target) noexcept {
  if (!is_finite(target)) return target;
  const Wrench way = held_ - target;
  if (turned_ == 0 && way.f.norm() < kUnfelt_n && way.t.norm() < kUnfelt_n_m) turned_ = kLong;
  shown_ = target + (held_ - target) * share();
  return shown_;
}

}  // namespace tandem::client
