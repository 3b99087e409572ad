#include "devices/eeg/classifier/sigmoid.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::eeg {
namespace {

constexpr int kMaxSteps = 100;

/// Target probabilities of the fit for the two states. They are slightly inside 0 and 1, so that the slope remains
/// finite for perfectly separable data.
struct Targets {
  double positive, negative;
};

double log_loss(const std::vector<std::pair<double, bool>>& decisions, const Targets& targets, const Sigmoid& s) {
  double loss = 0;
  for (const auto& [f, is_positive] : decisions) {
    const double t = is_positive ? targets.positive : targets.negative;
    const double z = s.slope * f + s.offset;
    // The last two terms are log(1 + exp(−z)), written so that exp() cannot overflow.
    loss += (1 - t) * z + std::max(-z, 0.0) + std::log1p(std::exp(-std::abs(z)));
  }
  return loss;
}

}  // namespace

Sigmoid fit_sigmoid(const std::vector<std::pair<double, bool>>& decisions) {
  double positive = 0;
  for (const auto& one : decisions) positive += one.second ? 1 : 0;
  const double negative = static_cast<double>(decisions.size()) - positive;
  const Targets targets{(positive + 1) / (positive + 2), 1 / (negative + 2)};
  const double base = std::log((positive + 1) / (negative + 1));
  Sigmoid fitted{0, base};
  double loss = log_loss(decisions, targets, fitted);
  for (int step = 0; step < kMaxSteps; ++step) {
    double h11 = 1e-12, h12 = 0, h22 = 1e-12, g1 = 0, g2 = 0;
    for (const auto& [f, is_positive] : decisions) {
      const double p = 1 / (1 + std::exp(-(fitted.slope * f + fitted.offset)));
      const double d = p - (is_positive ? targets.positive : targets.negative), w = p * (1 - p);
      g1 += f * d;
      g2 += d;
      h11 += f * f * w;
      h12 += f * w;
      h22 += w;
    }
    const double determinant = h11 * h22 - h12 * h12;
    if (std::max(std::abs(g1), std::abs(g2)) < 1e-6 || !(determinant > 0)) break;
    const double by_slope = -(h22 * g1 - h12 * g2) / determinant, by_offset = -(h11 * g2 - h12 * g1) / determinant;
    double share = 1;
    Sigmoid next = fitted;
    for (; share > 1e-10; share /= 2) {
      next = {fitted.slope + share * by_slope, fitted.offset + share * by_offset};
      if (log_loss(decisions, targets, next) < loss) break;
    }
    if (share <= 1e-10) break;
    fitted = next;
    loss = log_loss(decisions, targets, fitted);
  }
  return fitted.slope > 0 ? fitted : Sigmoid{0, base};
}

}  // namespace tandem::eeg
