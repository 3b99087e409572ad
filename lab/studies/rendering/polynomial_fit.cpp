#include "lab/studies/rendering/polynomial_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace tandem::lab {
namespace {

constexpr int kMaxDegree = 3;
/// A higher degree is accepted only if it reduces the error below this fraction of the lower degree's error.
constexpr double kWorthwhile = 0.9;

// Returns the RMS of the leave-one-out errors. The first and the last point are never left out, because the fit is not
// used to extrapolate.
double left_out_rms(std::span<const double> x, std::span<const double> y, int degree) {
  double square_sum = 0;
  for (std::size_t out = 1; out + 1 < x.size(); ++out) {
    std::vector<double> some_x(x.begin(), x.end());
    std::vector<double> some_y(y.begin(), y.end());
    some_x.erase(some_x.begin() + static_cast<std::ptrdiff_t>(out));
    some_y.erase(some_y.begin() + static_cast<std::ptrdiff_t>(out));
    const double error = least_squares(some_x, some_y, degree)(x[out]) - y[out];
    square_sum += error * error;
  }
  return std::sqrt(square_sum / static_cast<double>(x.size() - 2));
}

}  // namespace

haptics::Cubic least_squares(std::span<const double> x, std::span<const double> y, int degree) {
  // Dividing x by its maximum gives its powers similar magnitudes, so that the equations are well conditioned.
  double scale = 0;
  for (const double one : x) scale = std::max(scale, std::abs(one));
  if (scale == 0) scale = 1;
  const auto points = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixXd powers(points, degree + 1);
  Eigen::VectorXd values(points);
  for (Eigen::Index i = 0; i < points; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (int j = 0; j <= degree; ++j) powers(i, j) = std::pow(x[at] / scale, j);
    values(i) = y[at];
  }
  const Eigen::VectorXd solution = powers.colPivHouseholderQr().solve(values);
  haptics::Cubic result;
  for (int j = 0; j <= degree; ++j) result.c[static_cast<std::size_t>(j)] = solution(j) / std::pow(scale, j);
  return result;
}

ChosenFit chosen_fit(std::span<const double> x, std::span<const double> y,
                     const std::function<bool(const haptics::Cubic&)>& is_allowed) {
  if (x.size() <= 2) {
    // A line through two points has no leave-one-out error, but a constant would be wrong at both points.
    const ChosenFit constant{least_squares(x, y, 0), 0, 0};
    if (x.size() < 2 || y[0] == y[1]) return constant;
    const ChosenFit line{least_squares(x, y, 1), 1, 0};
    return is_allowed(line.cubic) ? line : constant;
  }
  ChosenFit best{least_squares(x, y, 0), 0, left_out_rms(x, y, 0)};
  for (int degree = 1; degree <= kMaxDegree && x.size() >= static_cast<std::size_t>(degree) + 2; ++degree) {
    const haptics::Cubic cubic = least_squares(x, y, degree);
    const double error = left_out_rms(x, y, degree);
    if (is_allowed(cubic) && error < kWorthwhile * best.left_out_rms) best = {cubic, degree, error};
  }
  return best;
}

}  // namespace tandem::lab
