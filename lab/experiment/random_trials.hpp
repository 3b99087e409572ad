// Random trials of the shipped contact cases, with random hands, paces, couplings, links and model errors: conditions
// that no parameter was tuned for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lab/experiment/trial_grid.hpp"

namespace tandem::lab {

/// Shipped experiments with contact.
const std::vector<std::string>& contact_cases();

/// Makes `count` trials in a fixed order; trial i depends on `seed` and i only.
///
/// Ranges  each hand: 0.1 to 1 kg, 100 to 600 N/m, damping ratio 0.35 to 0.8, tremor up to 0.05 N RMS. All users: pace
///         0.75 to 1.3, round trip 20 to 200 ms, jitter up to 10 ms, loss up to 5 %; three of ten with jitter correlated
///         over 20 to 300 ms, three of ten with a delay path (drift, steps or Wi-Fi); coupling 300 to 900 N/m. Half of
///         the trials have a local model whose mass and friction are wrong by up to 15 %.
/// Fails   std::invalid_argument: an experiment cannot be read
std::vector<Trial> random_trials(std::size_t count, std::uint64_t seed);

}  // namespace tandem::lab
