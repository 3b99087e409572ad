// Saves the recorded pose of two molecules in a room as a structure file.
#pragma once

#include <filesystem>
#include <optional>

#include "common/base/json.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

/// Writes the first two molecules of the recorded room, in their recorded pose, to `file`. The file's extension selects
/// PDB or mmCIF. An existing file is never overwritten.
///
/// In      recording  recording of a room
///         at         time since the start of the recording. The last recorded pose up to this time is saved. If `at`
///         is empty, the pose with the lowest field energy is saved
///         scene      scene file that replaces the one named in the recording; empty: the recorded one is used
/// Out     * t_s: time of the saved states
///         * lj_kj_mol, coulomb_kj_mol, total_kj_mol: energies by exact_field() and the model of the scene
///         * saved: path of the file
///         * rmsd_angstrom: RMSD between the saved pose of the second molecule relative to the first one and its
///           relative pose in the structure files
/// Fails   std::invalid_argument: see replay_session(); the scene has fewer than two molecules, there are no states up
///         to `at`, the extension is not supported, or the file exists. docking::MoleculeError: see save_complex()
boost::json::object save_recorded_complex(const std::filesystem::path& recording, std::optional<Duration> at,
                                          const std::filesystem::path& scene, const std::filesystem::path& file);

}  // namespace tandem::lab
