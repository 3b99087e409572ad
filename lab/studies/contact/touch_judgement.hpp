// What a trace of touch is judged by, and what this machine can do at best, measured in the same run.
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
  std::uint32_t looks_p50 = 0, looks_p99 = 0;  ///< distances asked of a field in a step: the same on every machine
  TimeQuantiles query_us;
  TimeQuantiles step_us;       ///< each step as fast as in the fastest of kRounds equal runs
  TimeQuantiles step_once_us;  ///< of the first run alone, with whatever interrupted it
  /// Overlap by the exact meshes. Checked every 50 steps up to 3 mm, and at 200 points of each body at every step.
  double max_penetration_m = 0;
  std::uint64_t pop_throughs = 0;
  double force_jump_max_n = 0;  ///< of the reduced contacts, see run_touch()
  /// From step to step of what the hand feels.
  double hand_force_step_max_n = 0, hand_torque_step_max_n_m = 0;
  std::size_t not_converged = 0;
  std::size_t separations = 0;  ///< how often contact was lost again
  /// The most that contact gave the tool from some moment on: its springs give back what they stored.
  double contact_returned_j = 0;
  /// Likewise beyond what the contacts' layers and friction held at that moment: what is not passive. What the rigid floor
  /// stores is in it, so it is an upper bound.
  double contact_created_j = 0;
};
TouchFigures figures_of(const std::vector<TouchTrace>& runs, const ExactSurface& tool, const ExactSurface& fixed);
/// Without the exact judgement, which takes seconds: times, contacts and force jump.
TouchFigures quick_figures_of(const std::vector<TouchTrace>& runs);

/// As often everything that is timed is run.
inline constexpr int kRounds = 3;
template <class Run>
std::vector<TouchTrace> in_rounds(const Run& run) {
  std::vector<TouchTrace> runs;
  for (int i = 0; i < kRounds; ++i) runs.push_back(run());
  return runs;
}

// What no method can beat here.

/// Distance and gradient at one point near the surface, everything in the cache.
double field_sample_ns(const contact::ContactShape& shape, const Clock& clock);
/// Of 256 KiB: the tail is what the machine itself adds to a step.
TimeQuantiles memory_copy_us(const Clock& clock);

}  // namespace tandem::lab
