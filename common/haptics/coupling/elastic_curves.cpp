#include "common/haptics/coupling/elastic_curves.hpp"

namespace tandem::haptics {
namespace {

/// Exponents from here on leave a curve at its limit to the last bit, and their squares could overflow.
constexpr double kSpent = 700;

}  // namespace

RadialStiffness linear_curve(double stiffness) noexcept {
  return {stiffness, stiffness};
}

RadialStiffness qsa_curve(double stiffness, double limit, double displacement) noexcept {
  const double u = stiffness * displacement / limit;
  if (!(u > 0)) return linear_curve(stiffness);
  if (u > kSpent) return {limit / displacement, 0};
  return {stiffness * (-std::expm1(-u) / u), stiffness * std::exp(-u)};
}

RadialStiffness stable_dynamic_curve(double stiffness, double limit, double sharpness, double displacement) noexcept {
  const double u = stiffness * displacement / limit;
  if (!(u > 0)) return {};
  const double exponent = sharpness * u * u;
  if (exponent > kSpent) return {limit / displacement, 0};
  return {stiffness * (-std::expm1(-exponent) / u), 2 * sharpness * u * stiffness * std::exp(-exponent)};
}

}  // namespace tandem::haptics
