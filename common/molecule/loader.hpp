// Structure files to molecules: a tolerant PDB reader and the OPLS-AA parameters of GROMACS's data files.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/molecule/molecule.hpp"

namespace tandem {

/// A structure or force-field file that cannot be used; what() names file, line and remedy.
class MoleculeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct StructureSelection {
  std::vector<std::string> chains;  ///< empty: all
};

/// Reads the protein atoms of the chosen chains (first model, first alternate location, no solvent, no
/// hetero groups) and gives each its OPLS-AA type, charge and Lennard-Jones parameters.
///
/// Source  the parameter files of `force_field_directory` (GROMACS: ffnonbonded.itp, aminoacids.rtp, …), read at
///         run time: Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225
/// Fails   MoleculeError: file missing, no atoms left, chain not there (names those that are)
Molecule load_molecule(const std::filesystem::path& structure, const StructureSelection& selection,
                       const std::filesystem::path& force_field_directory);

}  // namespace tandem
