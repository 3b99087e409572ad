// Bounds on the results of random trials (lab/experiment/random_trials.hpp).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/base/json.hpp"

namespace tandem::lab {

/// The row of a random trial in results.json, and whether the same hands complete the trial on the reference stage at
/// zero delay.
struct RandomOutcome {
  boost::json::object row;
  bool truth_succeeds = true;
  std::size_t number = 0;  ///< index of the trial in random_trials()
};

struct RandomClaim {
  std::string text;        ///< text of the claim, with unit
  double value = 0;        ///< NaN if no trial of the claim has a value
  double bound = 0;        ///< upper bound for `value`
  std::size_t trials = 0;  ///< number of trials that have a value
  std::string worst;       ///< experiment and number of the trial that determines the value

  bool is_measured() const { return trials > 0; }
  /// Returns false if no trial has a value.
  bool holds() const { return is_measured() && value <= bound; }
};

/// Computes all claims. During a silence of the link of more than 110 ms, the displayed force must decay, which spoils
/// the other metrics. Therefore a trial with such a silence counts only in claims about silences.
std::vector<RandomClaim> random_claims(std::span<const RandomOutcome> outcomes);

}  // namespace tandem::lab
