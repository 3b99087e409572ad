// Reproduces the docking of two helices in the source thesis, with and without its stable method, for `tandem-lab
// reproduce`.
//
// Source  Hou Xiyuan, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, chapter 7
#pragma once

#include <filesystem>

#include "common/base/time.hpp"
#include "lab/results/reproduction.hpp"

namespace tandem::lab {

/// Returns the file with two designed helices from Debian's package pymol-data. The parameter file of gromacs-data is
/// used if it is installed.
std::filesystem::path docking_file();
/// Runs the comparison.
/// Fails   docking::MoleculeError: one of the two files is missing; the message names the package
Reproduction reproduce_docking(const Clock& clock);

}  // namespace tandem::lab
