// A room of two structure files, from the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "tandem/scene.pb.h"

namespace tandem::server {

/// Declares --receptor, --ligand and what goes with them.
/// Out     to be filled by the parser: bodies[0] and bodies[1] with a molecule each, where both were given, and the field
std::shared_ptr<const wire::Scene> declare_docking(CLI::App& app);

/// Writes the scene of receptor and ligand into `folder`, under a name that goes with its content, so that recordings of it
/// can be played back later.
///
/// Out     the file; empty: nothing was given
/// Fails   std::invalid_argument: only one was given, or the folder is empty or cannot be written;
///         docking::MoleculeError, see docking_scene()
std::filesystem::path write_docking_scene(const wire::Scene& asked, const std::filesystem::path& folder);

}  // namespace tandem::server
