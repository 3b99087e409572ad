// Figures of merit of a contact trace, and lower bounds for durations on this machine, measured in the same run.
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
  /// Number of distance queries to a grid in a step: median and 99th percentile. They do not depend on the machine.
  std::uint32_t queries_p50 = 0, queries_p99 = 0;
  TimeQuantiles query_us;
  /// quantiles of the step's duration; for each step, the shortest duration of kRounds equal runs is used
  TimeQuantiles step_us;
  /// quantiles of the step's duration in the first run, which includes interruptions by other processes
  TimeQuantiles step_once_us;
  /// Largest overlap according to the exact meshes. It is the maximum of two measurements: all vertices and edges in
  /// every 50th step, up to a depth of 3 mm, and 200 surface points of each body in every step.
  double max_penetration_m = 0;
  std::uint64_t pop_throughs = 0;
  double force_jump_max_n = 0;  ///< force jump for the reduced contacts; see run_touch()
  /// Largest change of the wrench on the hand between two successive steps.
  double hand_force_step_max_n = 0, hand_torque_step_max_n_m = 0;
  std::size_t not_converged = 0;
  std::size_t separations = 0;  ///< number of times that contact was lost
  /// Largest net work of the contact on the tool over any interval. A positive value does not violate passivity,
  /// because springs return energy that they stored before the interval.
  double contact_returned_j = 0;
  /// Same as contact_returned_j, minus the energy that contact layers and friction stored at the start of the interval.
  /// A positive value violates passivity, unless it is energy from a depth at which contact is rigid. Energy stored
  /// there is not subtracted, so the value is an upper bound.
  double contact_created_j = 0;
};
TouchFigures figures_of(const std::vector<TouchTrace>& runs, const ExactSurface& tool, const ExactSurface& fixed);
/// Returns all figures except the exact overlap, whose computation takes seconds.
TouchFigures quick_figures_of(const std::vector<TouchTrace>& runs);

/// Number of repetitions of each timed run.
inline constexpr int kRounds = 3;
template <class Run>
std::vector<TouchTrace> in_rounds(const Run& run) {
  std::vector<TouchTrace> runs;
  for (int i = 0; i < kRounds; ++i) runs.push_back(run());
  return runs;
}

// The following functions measure the speed of this machine. Their results are lower bounds for every contact method.

/// Returns the time of one query for distance and gradient near the surface, with all data in the cache.
double field_sample_ns(const contact::ContactShape& shape, const Clock& clock);
/// Returns the time to copy 256 KiB. The tail of its distribution is the jitter that the machine adds to a step.
TimeQuantiles memory_copy_us(const Clock& clock);

}  // namespace tandem::lab
