// Bounds on the results of random trials (lab/experiment/random_trials.hpp).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/base/json.hpp"

namespace tandem::lab {

/// A random trial's row of results.json, and whether the same hands succeed in it at zero delay.
struct RandomOutcome {
  boost::json::object row;
  bool truth_succeeds = true;
};

struct RandomClaim {
  std::string text;   ///< with unit
  double value = 0;   ///< NaN: no trial of this kind has a value
  double bound = 0;   ///< the value is at most this
  std::string worst;  ///< the trial that decides: experiment and seed

  /// A claim without trials does not fail.
  bool holds() const { return !(value > bound); }
};

/// Trials in which a link was silent for more than 110 ms count only where a claim says so: there the force has to fall.
std::vector<RandomClaim> random_claims(std::span<const RandomOutcome> outcomes);

}  // namespace tandem::lab
