// Room of two structure files, from the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>

namespace tandem::server {

/// Writes the scene of receptor and ligand into a folder. The file name depends on the content, so that recordings of
/// the scene can be played back later.
///
/// Out     the file; empty: neither was given
/// Fails   std::invalid_argument: only one was given, or options for both without files, or the folder is empty or
///         cannot be written; docking::MoleculeError, see docking_scene()
using WriteDockingScene = std::function<std::filesystem::path(const std::filesystem::path& folder)>;

/// Declares --receptor, --ligand and their options.
/// Out     function to call after parsing
WriteDockingScene declare_docking(CLI::App& app);

}  // namespace tandem::server
