// A receptor and a ligand in a pose, as a file for viewers and other programs: PDB or mmCIF.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"
#include "common/docking/molecule_error.hpp"

namespace tandem::server {

/// Both molecules as one structure that the readers read back: every atom with name, element, residue, chain and
/// coordinates. The receptor's coordinates are those of its file, so that the complex lies over the original in a viewer.
///
/// A chain of the ligand that the receptor has too, and one without a name, gets a free letter; remarks say which, and the
/// pose. ATOM: residues with N, CA and C, and nucleotides; all others HETATM. TER after each chain. What was not taken
/// from a file is not in it, and of a PQR file neither charges nor radii.
///
/// Source  wwPDB, "PDB file format" 3.30, ATOM, TER and REMARK
/// In      X_AB     pose of the ligand's file in the receptor's, position [Å]
///         remarks  lines for people, as REMARK; bytes other than printable ASCII become '?', long lines are divided
/// Out     coordinates with 3 decimals [Å]
/// Fails   MoleculeError naming the atom: more atoms and TER than 99,999, more chains than 62, names above 4 letters,
///         chains above 1, numbers outside -999 … 9999, coordinates outside -999.999 … 9999.999 Å (write mmCIF); bytes
///         in a name that are not printable ASCII. std::invalid_argument: see docking::residue_starts(); a pose that is
///         not finite
std::string complex_pdb(const docking::Molecule& receptor, const docking::Molecule& ligand, const Pose& X_AB_angstrom,
                        std::span<const std::string> remarks = {});

/// Likewise without PDB's limits: coordinates with 3 to 6 decimals, remarks as comments. label_asym_id is one for each
/// chain and part of a chain; names, numbers and chains of the molecules are auth_….
///
/// Fails   MoleculeError: a name that is not printable ASCII or has both kinds of quotes
std::string complex_mmcif(const docking::Molecule& receptor, const docking::Molecule& ligand, const Pose& X_AB_angstrom,
                          std::span<const std::string> remarks = {});

/// To be asked before the work.
///
/// Fails   std::invalid_argument: the name ends neither in .pdb nor in .cif
void check_complex_name(const std::filesystem::path& file);

/// Writes what the name's ending asks for, under another name first: who reads meanwhile sees what was there before.
///
/// Fails   MoleculeError naming the file: as above, or what stands in the way of writing
void save_complex(const std::filesystem::path& file, const docking::Molecule& receptor, const docking::Molecule& ligand,
                  const Pose& X_AB_angstrom, std::span<const std::string> remarks = {});

/// "Lennard-Jones -12.5, … kJ/mol", and the model behind it.
std::vector<std::string> energy_remarks(const docking::FieldResult& result, const docking::FieldModel& model);

}  // namespace tandem::server
