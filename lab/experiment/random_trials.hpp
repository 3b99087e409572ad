// Random trials of the shipped experiments that have contact. Hands, speeds, couplings, links and model errors are
// random. No parameter of the project was tuned for these conditions. Therefore the trials test whether its results
// hold under conditions for which it was not developed.
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
/// Ranges  hand        mass 0.1 to 1 kg, stiffness 100 to 600 N/m, damping ratio 0.35 to 0.8, tremor up to 0.05 N RMS
///         all users   pace of the hand's path 0.75 to 1.3, round trip 20 to 200 ms, jitter up to 10 ms, loss up to 5 %
///         link        in 3 of 10 trials, the jitter is correlated over 20 to 300 ms; in 3 of 10 trials, the link has a
///                     delay path (drift, steps or Wi-Fi)
///         coupling    stiffness 300 to 900 N/m
///         model       in half of the trials, mass and friction of the local model are wrong by up to 15 %
/// Fails   std::invalid_argument: an experiment cannot be read
std::vector<Trial> random_trials(std::size_t count, std::uint64_t seed);

}  // namespace tandem::lab
