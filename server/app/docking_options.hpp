// A room of two structure files, from the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>

namespace tandem::server {

/// Writes the scene of receptor and ligand into a folder, under a name that goes with its content, so that recordings of it
/// can be played back later.
///
/// Out     the file; empty: neither was given
/// Fails   std::invalid_argument: only one was given, or what goes with both, or the folder is empty or cannot be written;
///         docking::MoleculeError, see docking_scene()
using WriteDockingScene = std::function<std::filesystem::path(const std::filesystem::path& folder)>;

/// Declares --receptor, --ligand and what goes with them.
/// Out     to be called after the parser
WriteDockingScene declare_docking(CLI::App& app);

}  // namespace tandem::server
