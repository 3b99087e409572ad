// Figures computed from a contact trace, and the speed limits of this machine, measured in the same run.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lab/studies/contact/quantiles.hpp"
#include "lab/studies/contact/touch_object.hpp"
#include "lab/studies/contact/touch_simulation.hpp"

namespace tandem::lab {

struct TouchFigures {
  std::size_t steps = 0;
  std::uint32_t contacts_max = 0;
  std::uint32_t queries_p50 = 0, queries_p99 = 0;  ///< distance queries to a field in a step: the same on every machine
  TimeQuantiles query_us;
  TimeQuantiles step_us;       ///< per step, the shortest time of kRounds equal runs
  TimeQuantiles step_once_us;  ///< times of the first run alone, interruptions included
  /// Overlap by the exact meshes: every 50 steps up to a depth of 3 mm, and at 200 points of each body in every step.
  double max_penetration_m = 0;
  std::uint64_t pop_throughs = 0;
  double force_jump_max_n = 0;  ///< for the reduced contacts, see run_touch()
  /// Largest change of the wrench on the hand from step to step.
  double hand_force_step_max_n = 0, hand_torque_step_max_n_m = 0;
  std::size_t not_converged = 0;
  std::size_t separations = 0;  ///< number of times that contact was lost
  /// Largest net work of contact on the tool over any interval: the springs return stored energy.
  double contact_returned_j = 0;
  /// The same, less the energy stored in contact layers and friction at the start of the interval: energy that
  /// violates passivity. Energy stored in the rigid floor is included, so it is an upper bound.
  double contact_created_j = 0;
};
TouchFigures figures_of(const std::vector<TouchTrace>& runs, const ExactSurface& tool, const ExactSurface& fixed);
/// Figures without the exact overlap, which takes seconds: times, contacts and force jump.
TouchFigures quick_figures_of(const std::vector<TouchTrace>& runs);

/// Number of runs of everything that is timed.
inline constexpr int kRounds = 3;
template <class Run>
std::vector<TouchTrace> in_rounds(const Run& run) {
  std::vector<TouchTrace> runs;
  for (int i = 0; i < kRounds; ++i) runs.push_back(run());
  return runs;
}

// Speed limits of this machine: lower bounds for every method.

/// Time of one distance with gradient near the surface, with everything in the cache.
double field_sample_ns(const contact::ContactShape& shape, const Clock& clock);
/// Time to copy 256 KiB: its tail is the jitter that the machine itself adds to a step.
TimeQuantiles memory_copy_us(const Clock& clock);

}  // namespace tandem::lab
