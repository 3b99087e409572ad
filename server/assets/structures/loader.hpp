// Structure files to molecules: a tolerant PDB reader and the OPLS-AA parameters of GROMACS's data files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/docking/molecule.hpp"
#include "common/docking/molecule_error.hpp"

namespace tandem::server {

/// Reads the protein atoms of these chains, or of all when none is named (first model, first alternate location, no
/// solvent, no hetero groups) and gives each its OPLS-AA type, charge and Lennard-Jones parameters.
///
/// An atom without an exact entry is typed by its element (residue_typing.hpp) and named in Molecule::guessed; atoms
/// that the file lacks or the force field does not know are counted in Molecule::notes. Nothing is added: a file
/// without hydrogens gives heavy atoms with all-atom parameters, whose attraction is about a third too weak.
///
/// Source  the parameter files of `force_field_directory` (GROMACS: ffnonbonded.itp, aminoacids.rtp, …), read at
///         run time: Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225
/// Fails   MoleculeError: file missing or damaged, no atoms left, chain not there (names those that are), force
///         field missing (names the Debian package) or with another mixing rule than the geometric one
docking::Molecule load_molecule(const std::filesystem::path& structure, const std::vector<std::string>& chains,
                                const std::filesystem::path& force_field_directory);

}  // namespace tandem::server
