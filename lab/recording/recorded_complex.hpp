// The pose of two molecules in a room's recording, saved as a structure file.
#pragma once

#include <filesystem>
#include <optional>

#include "common/base/json.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

/// Writes the first two molecules of the recorded room in their recorded pose. The file's extension selects PDB or
/// mmCIF. Never overwrites a file.
///
/// In      recording  a room's recording
///         at      time since the start of the recording: the last states up to it are saved; none: the states of least
///                 field energy
///         scene   used instead of the scene file that the recording names; empty: the recorded name
/// Out     t_s, lj_kj_mol, coulomb_kj_mol and total_kj_mol (exact_field(), the scene's model), saved, and
///         rmsd_angstrom: RMSD of the second molecule from its pose in the files, with the first molecule superposed
///         on its own file
/// Fails   std::invalid_argument: as replay_session(); a scene with fewer than two molecules, no states up to `at`, an
///         unsupported extension, or a file that exists; docking::MoleculeError: see save_complex()
boost::json::object save_recorded_complex(const std::filesystem::path& recording, std::optional<Duration> at,
                                          const std::filesystem::path& scene, const std::filesystem::path& file);

}  // namespace tandem::lab
