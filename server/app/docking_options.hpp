// Room with two molecules from structure files that are named on the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>

namespace tandem::server {

/// Writes the scene of receptor and ligand into a folder. The file name depends on the content, so that recordings of
/// the scene can be played back later.
///
/// Out     path of the file; empty: neither molecule was given
/// Fails   std::invalid_argument: only one molecule was given, or only their common options, or the folder is empty or
///         cannot be written; docking::MoleculeError, see docking_scene()
using WriteDockingScene = std::function<std::filesystem::path(const std::filesystem::path& folder)>;

/// Declares --receptor, --ligand and their options.
/// Out     function to call after parsing
WriteDockingScene declare_docking(CLI::App& app);

}  // namespace tandem::server
