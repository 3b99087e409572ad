// Writes a receptor and a ligand in a pose as a file for viewers and other programs: PDB or mmCIF.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"
#include "common/docking/molecule_error.hpp"

namespace tandem::server {

/// Returns both molecules as one structure that the readers can read: every atom with name, element, residue, chain and
/// coordinates. The receptor keeps the coordinates of its file, so a viewer shows the complex on top of the original.
///
/// A chain without a name gets a free letter, as does a chain of the ligand that the receptor has too. Remarks state the
/// letters and the pose. ATOM: residues with N, CA and C, and nucleotides; all others HETATM. TER after each chain. Parts
/// of the files that were not loaded are left out, as are charges and radii of a PQR file.
///
/// Source  wwPDB, "PDB file format" 3.30, ATOM, TER and REMARK
/// In      X_AB     pose of the ligand's file frame in the receptor's file frame, position [Å]
///         remarks  lines for the user, as REMARK; bytes other than printable ASCII become '?', long lines are divided
/// Out     coordinates with 3 decimals [Å]
/// Fails   MoleculeError naming the atom: more atoms and TER than 99,999, more chains than 62, names above 4 letters,
///         chains above 1, numbers outside -999 … 9999, coordinates outside -999.999 … 9999.999 Å (write mmCIF); bytes
///         in a name that are not printable ASCII. std::invalid_argument: see docking::residue_starts(); a pose that is
///         not finite
std::string complex_pdb(const docking::Molecule& receptor, const docking::Molecule& ligand, const Pose& X_AB_angstrom,
                        std::span<const std::string> remarks = {});

/// Same as complex_pdb() without the limits of PDB: coordinates with 3 to 6 decimals, remarks as comments. Each chain
/// and part of a chain has its own label_asym_id; names, numbers and chains of the molecules are auth_….
///
/// Fails   MoleculeError: a name that is not printable ASCII or has both kinds of quotes
std::string complex_mmcif(const docking::Molecule& receptor, const docking::Molecule& ligand, const Pose& X_AB_angstrom,
                          std::span<const std::string> remarks = {});

/// Checks the name of the file, before the complex is computed.
///
/// Fails   std::invalid_argument: the name ends neither in .pdb nor in .cif
void check_complex_name(const std::filesystem::path& file);

/// Writes the format of the file's extension. The data are written under another name first, so a concurrent reader
/// never gets a partial file.
///
/// Fails   MoleculeError naming the file: as above, or the error of writing
void save_complex(const std::filesystem::path& file, const docking::Molecule& receptor, const docking::Molecule& ligand,
                  const Pose& X_AB_angstrom, std::span<const std::string> remarks = {});

/// "Lennard-Jones -12.5, … kJ/mol", and the field model.
std::vector<std::string> energy_remarks(const docking::FieldResult& result, const docking::FieldModel& model);

}  // namespace tandem::server
