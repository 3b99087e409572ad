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
  std::size_t number = 0;  ///< place in random_trials()
};

struct RandomClaim {
  std::string text;        ///< with unit
  double value = 0;        ///< NaN: no trial of this kind has a value
  double bound = 0;        ///< the value is at most this
  std::size_t trials = 0;  ///< that have a value
  std::string worst;       ///< the trial that decides: experiment and number

  bool is_measured() const { return trials > 0; }
  /// A claim that nothing was measured for does not hold.
  bool holds() const { return is_measured() && value <= bound; }
};

/// Trials in which a link was silent for more than 110 ms count only where a claim says so: there the force has to fall.
std::vector<RandomClaim> random_claims(std::span<const RandomOutcome> outcomes);

}  // namespace tandem::lab
