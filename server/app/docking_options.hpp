// Command line options for a docking room: two molecules, receptor and ligand, from structure files.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>

namespace tandem::server {

/// Writes a scene file with receptor and ligand into a folder. The file name contains a hash of the content. A later
/// scene with other content thus does not replace the file, and a recording can still find it.
///
/// Out     path of the file; empty: neither molecule was given
/// Fails   std::invalid_argument: only one of the two molecules is given; or an option for molecules is given without a
///         molecule; or the folder is empty or cannot be written. docking::MoleculeError: see docking_scene()
using WriteDockingScene = std::function<std::filesystem::path(const std::filesystem::path& folder)>;

/// Declares --receptor, --ligand and the options that apply to both molecules.
/// Out     function that writes the scene; call it after the command line has been parsed
WriteDockingScene declare_docking(CLI::App& app);

}  // namespace tandem::server
