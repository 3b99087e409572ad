// Twice differentiable curves for a smooth continuation of a displayed value: a B-spline segment, and a difference that
// fades out.
#pragma once

#include <array>

namespace tandem::haptics {

/// Value of a curve and its derivatives with respect to the curve's parameter.
struct CurvePoint {
  double value = 0;
  double slope = 0;
  double curvature = 0;

  CurvePoint operator+(const CurvePoint& b) const {
    return {value + b.value, slope + b.slope, curvature + b.curvature};
  }
  CurvePoint operator-(const CurvePoint& b) const {
    return {value - b.value, slope - b.slope, curvature - b.curvature};
  }
};

/// Returns a point on a segment of the uniform cubic B-spline with four control points, u = 0 … 1.
///
/// Model    x(u) = [(1−u)³ c_0 + (3u³ − 6u² + 4) c_1 + (−3u³ + 3u² + 3u + 1) c_2 + u³ c_3]/6, from
///          (c_0 + 4 c_1 + c_2)/6 to (c_1 + 4 c_2 + c_3)/6. Adjacent segments share three control points and join with
///          two continuous derivatives.
/// Source   de Boor, "A Practical Guide to Splines", 1978
inline CurvePoint uniform_cubic(const std::array<double, 4>& c, double u) {
  const double v = 1 - u;
  return {(v * v * v * c[0] + ((3 * u - 6) * u * u + 4) * c[1] + (((3 - 3 * u) * u + 3) * u + 1) * c[2] +
           u * u * u * c[3]) /
              6,
          (-v * v * c[0] + (3 * u - 4) * u * c[1] + ((2 - 3 * u) * u + 1) * c[2] + u * u * c[3]) / 2,
          v * c[0] + (3 * u - 2) * c[1] + (1 - 3 * u) * c[2] + u * c[3]};
}

/// Returns what remains at s = 0 … 1 of a difference `d` that fades out smoothly. At s = 0, value, slope and curvature
/// equal those of `d`. For s ≥ 1, all three are zero.
///
/// Model   the quintic polynomial that satisfies the three conditions at s = 0 and the three at s = 1
inline CurvePoint faded(const CurvePoint& d, double s) {
  if (s <= 0) return d;
  if (s >= 1) return {};
  const double a = d.value, b = d.slope, c = d.curvature / 2;
  const double p3 = -10 * a - 6 * b - 3 * c;
  const double p4 = 15 * a + 8 * b + 3 * c;
  const double p5 = -6 * a - 3 * b - c;
  return {a + s * (b + s * (c + s * (p3 + s * (p4 + s * p5)))),
          b + s * (2 * c + s * (3 * p3 + s * (4 * p4 + s * 5 * p5))),
          2 * c + s * (6 * p3 + s * (12 * p4 + s * 20 * p5))};
}

}  // namespace tandem::haptics
