// Reproduces the two touch benchmarks of the source thesis: two bunnies, and a peg in a hole.
//
// Source  Hou Xiyuan, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, chapters 4 and 5
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/time.hpp"
#include "lab/results/reproduction.hpp"
#include "lab/studies/contact/touch_simulation.hpp"

namespace tandem::lab {

/// A named run of one tool, drawn as one curve.
struct NamedTrace {
  std::string name;
  TouchTrace trace;
};
/// Returns figures over time: force, time of a step, number of contacts, and torque.
std::vector<Plot> touch_figures(const std::vector<NamedTrace>& runs, const std::vector<std::string>& phases);

/// Returns the file with the bunny's mesh, from Debian's package glmark2-data.
std::filesystem::path bunny_file();
/// Reproduces the contact of two bunnies.
/// Fails   std::invalid_argument: the bunny's file is missing; the message names the package
Reproduction reproduce_bunny(const Clock& clock);
/// Reproduces the peg in a hole, with the hand path lab/paths/peg_five_steps.json for every mass.
Reproduction reproduce_peg(const Clock& clock);

}  // namespace tandem::lab
