// Bounds on the results of random trials (lab/experiment/random_trials.hpp).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/base/json.hpp"

namespace tandem::lab {

/// A random trial's row of results.json, and whether the same hands succeed in it at zero delay.
struct RandomOutcome {
  boost::json::object row;
  bool truth_succeeds = true;
  std::size_t number = 0;  ///< index in random_trials()
};

struct RandomClaim {
  std::string text;        ///< with unit
  double value = 0;        ///< NaN if no trial of this kind has a value
  double bound = 0;        ///< upper bound of the value
  std::size_t trials = 0;  ///< number of trials with a value
  std::string worst;       ///< trial that determines the value: experiment and number

  bool is_measured() const { return trials > 0; }
  /// Returns false for a claim without measurements.
  bool holds() const { return is_measured() && value <= bound; }
};

/// Computes all claims. Trials with a link silence above 110 ms count only for claims that mention it: in a silence the
/// force has to fall.
std::vector<RandomClaim> random_claims(std::span<const RandomOutcome> outcomes);

}  // namespace tandem::lab
