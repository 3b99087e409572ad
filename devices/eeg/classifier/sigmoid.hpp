// Platt's sigmoid: converts the decision value of a classifier to the probability of the positive state.
#pragma once

#include <utility>
#include <vector>

namespace tandem::eeg {

/// p(positive) = 1/(1 + exp(−(slope f + offset))) for the decision value f. The slope is not negative.
struct Sigmoid {
  double slope = 0;
  double offset = 0;
};

/// Fits the sigmoid by maximum likelihood, with Newton's method.
///
/// Source  Lin, Lin, Weng, "A note on Platt's probabilistic outputs for support vector machines", Machine Learning 68,
///         2007, with its targets and regularisation. Difference: if the fit gives a negative slope, the slope is 0,
///         and the probability is then the relative frequency of the positive state
/// In      decisions  for each window the decision value, and whether the state is positive
Sigmoid fit_sigmoid(const std::vector<std::pair<double, bool>>& decisions);

}  // namespace tandem::eeg
