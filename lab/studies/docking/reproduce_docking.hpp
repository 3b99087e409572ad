// The thesis' docking of two helices, with and without its stable method, for `tandem-lab reproduce`.
//
// Source  Hou Xiyuan, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, chapter 7
#pragma once

#include <filesystem>

#include "common/base/time.hpp"
#include "lab/results/reproduction.hpp"

namespace tandem::lab {

/// Two designed helices from Debian's package pymol-data; if they are installed, the parameter file of gromacs-data.
std::filesystem::path docking_file();
/// Fails   docking::MoleculeError when one of the two files is missing (names the package)
Reproduction reproduce_docking(const Clock& clock);

}  // namespace tandem::lab
