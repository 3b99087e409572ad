// The source thesis' docking of two helices, with its stable method and without, for `tandem-lab reproduce`.
//
// Source  Hou Xiyuan, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, chapter 7
#pragma once

#include <filesystem>

#include "common/base/time.hpp"
#include "lab/results/reproduction.hpp"

namespace tandem::lab {

/// Two designed helices, of Debian's package pymol-data; where they are there, the parameters of gromacs-data.
std::filesystem::path docking_file();
/// Fails   docking::MoleculeError when one of the two is not there (names the package)
Reproduction reproduce_docking(const Clock& clock);

}  // namespace tandem::lab
