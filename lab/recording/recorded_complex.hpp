// What two molecules were brought to in a recording of a room, as a structure file.
#pragma once

#include <filesystem>
#include <optional>

#include "common/base/json.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

/// Writes the first two molecules of the recorded room as they were, PDB or mmCIF by the name's ending, never over a file.
///
/// In      recording  of a room
///         at      since the recording began, the last states before it; none: those of least energy of all molecules
///         scene   instead of the file that the recording names; empty: that
/// Out     t_s, lj_kj_mol, coulomb_kj_mol and total_kj_mol (exact_field(), the scene's model), rmsd_angstrom of the second
///         molecule from where the files have it, the first laid over its file; saved
/// Fails   std::invalid_argument: as replay_session(); a scene with fewer than two molecules, no states by then, a name that
///         ends otherwise or is taken; docking::MoleculeError: see save_complex()
boost::json::object save_recorded_complex(const std::filesystem::path& recording, std::optional<Duration> at,
                                          const std::filesystem::path& scene, const std::filesystem::path& file);

}  // namespace tandem::lab
