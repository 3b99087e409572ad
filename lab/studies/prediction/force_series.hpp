// Forces on a hand at 1 kHz in the shipped scenes and benchmarks, as test signals for predictors. Each series is
// simulated here by the same code as elsewhere; none is stored.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

struct ForceSample {
  Duration at{0};
  Wrench on_hand_W;
  bool has_contact_changed = false;  ///< contact began or ended since the previous sample
};

struct ForceSeries {
  std::string name;
  std::string what;
  std::vector<ForceSample> samples;  ///< times increase; evenly spaced except in chatter_series()
};

/// Peg in hole in five steps with a peg of this mass and exact contact.
ForceSeries peg_series(double mass_kg);
/// Two bunnies pressed together, slid and twisted.
/// Fails   std::invalid_argument when the bunny's file is missing (names the package)
ForceSeries bunny_pair_series();

/// All of the above that this installation can make, and the force on the first hand in shipped scenes with a
/// simulated hand at each tool. The bunnies are included where their file exists.
std::vector<ForceSeries> shipped_series();

/// Chattering contact of the thesis's kind: peg and box in GImpact, stock Bullet with its default solver. Each time
/// step is as long as the previous step would take on a slow machine.
///
/// Model   step h = 2 ms + 0.25 ms for each contact, within 2 … 10 ms: 100 to 500 Hz. Ours; the thesis says "variable,
///         less than 100 to several 100 Hz"
ForceSeries chatter_series(double mass_kg);

/// RMS deviation of the force from its mean over the surrounding 20 ms, over samples with a force: the part that no
/// hand produces.
double noise_n(const ForceSeries& series);

}  // namespace tandem::lab
