// Forces on a hand at 1 kHz in the shipped scenes and benchmarks, used as test signals for predictors. Each series is
// simulated here with the code of the other studies; none is stored in a file.
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
  bool has_contact_changed = false;  ///< whether contact began or ended since the previous sample
};

struct ForceSeries {
  std::string name;
  std::string what;
  /// samples in ascending order of time, at a constant interval except in chatter_series()
  std::vector<ForceSample> samples;
};

/// Returns the forces of the benchmark peg-in-hole in five steps, with a peg of this mass and exact contact.
ForceSeries peg_series(double mass_kg);
/// Returns the forces of two bunnies that are pressed together, slide and twist.
/// Fails   std::invalid_argument: the bunny's file is missing; the message names the package
ForceSeries bunny_pair_series();

/// Returns the peg series, the bunny series if the bunny's file exists, and one series for each shipped scene: the
/// force on the first hand.
std::vector<ForceSeries> shipped_series();

/// Returns the force of a chattering contact (rapid alternation of contact and separation), as in the thesis Hou 2014.
/// Peg and box are simulated by unmodified Bullet with GImpact and the default solver. Each time step is as long as the
/// computation of the previous step would take on a slow machine.
///
/// Model   step h = 2 ms + 0.25 ms for each contact, limited to 2 … 10 ms: 100 to 500 Hz. This model is our own; the
///         thesis states "variable, less than 100 to several 100 Hz"
ForceSeries chatter_series(double mass_kg);

/// Returns the noise of a series: the RMS deviation of the force from its mean over the surrounding 20 ms. Samples
/// without force are excluded. The deviation is noise, because a hand moves too slowly to cause it.
double noise_n(const ForceSeries& series);

}  // namespace tandem::lab
