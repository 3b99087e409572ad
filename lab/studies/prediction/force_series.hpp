// The forces that a hand feels in the shipped scenes and benchmarks, a thousand times a second: what predictions are
// tried on. Each is made here, by the same simulation as runs elsewhere; none is stored.
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
  bool has_contact_changed = false;  ///< contact began or ended since the sample before
};

struct ForceSeries {
  std::string name;
  std::string what;
  std::vector<ForceSample> samples;  ///< times increase; even in all but chatter_series()
};

/// Peg in hole in five steps, peg of this mass, exact contact.
ForceSeries peg_series(double mass_kg);
/// Two bunnies pressed on each other, slid and twisted.
/// Fails   std::invalid_argument when the bunny's file is not there (names the package)
ForceSeries bunny_pair_series();

/// All of the above that every installation can make, and what the first hand feels in shipped scenes with a simulated
/// hand at each tool; the bunnies where their file is.
std::vector<ForceSeries> shipped_series();

/// Chattering contact of the thesis's kind: the peg and the box in GImpact, stock Bullet with its default solver, at a
/// step that is as long as the step before took on a slow machine.
///
/// Model    step h = 2 ms + 0.25 ms for each contact, within 2 … 10 ms: 100 to 500 Hz. Ours; the thesis says "variable,
///          less than 100 to several 100 Hz"
/// In       clock  GImpactReference asks for one; its times are not used
ForceSeries chatter_series(double mass_kg);

/// RMS of the force's deviation from its mean over 20 ms around, while it is not zero: what of it no hand makes.
double noise_n(const ForceSeries& series);

}  // namespace tandem::lab
