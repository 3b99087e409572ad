// Probability of a state from the decision value of a classifier.
#pragma once

#include <utility>
#include <vector>

namespace tandem::eeg {

/// p(positive) = 1/(1 + exp(−(slope f + offset))). The slope is not negative.
struct Sigmoid {
  double slope = 0;
  double offset = 0;
};

/// Fits the sigmoid by maximum likelihood, with Newton's method.
///
/// Source  Lin, Lin, Weng, "A note on Platt's probabilistic outputs for support vector machines", Machine Learning 68,
///         2007: targets and regularisation; a slope below 0 becomes 0, with the rate of the states as probability
/// In      decisions  decision value, and whether the state is positive
Sigmoid fit_sigmoid(const std::vector<std::pair<double, bool>>& decisions);

}  // namespace tandem::eeg
