// Random trials of the shipped experiments with contact. Hands, speeds, couplings, links and model errors are random.
// No parameter of the project was tuned for these conditions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lab/experiment/trial_grid.hpp"

namespace tandem::lab {

/// Names of the shipped experiments that have contact.
const std::vector<std::string>& contact_cases();

/// Generates `count` trials in a fixed order. Trial i depends only on `seed` and i.
///
/// Ranges  Each hand has 0.1 to 1 kg, 100 to 600 N/m, a damping ratio of 0.35 to 0.8 and a tremor of up to 0.05 N RMS.
///         All users of a trial share a pace of 0.75 to 1.3, a round trip of 20 to 200 ms, jitter up to 10 ms and loss
///         up to 5 %. In three of ten trials the jitter is correlated over 20 to 300 ms, and three of ten have a delay
///         path (drift, steps or Wi-Fi). The coupling has 300 to 900 N/m. In half of the trials the mass and friction
///         of the local model are wrong by up to 15 %.
/// Fails   std::invalid_argument: an experiment cannot be read
std::vector<Trial> random_trials(std::size_t count, std::uint64_t seed);

}  // namespace tandem::lab
