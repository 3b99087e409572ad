// Writes a receptor and a ligand in a pose to one PDB or mmCIF file, for viewers and other programs.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"
#include "common/docking/molecule_error.hpp"

namespace tandem::server {

/// Returns both molecules as one structure, which the readers of this folder can read. Every atom has its name,
/// element, residue, chain and coordinates. The receptor keeps the coordinates of its file, so that a viewer can
/// superimpose the complex on the original.
///
/// * A chain gets an unused letter as its name if it has no name, or if it is a chain of the ligand and the receptor
///   has a chain of that name. Remarks state these letters and the pose.
/// * Residues with N, CA and C, and nucleotides, are written as ATOM records, all other residues as HETATM. A TER
///   follows each chain.
/// * Atoms that were not loaded, and the charges and radii of a PQR file, are omitted.
///
/// Source  wwPDB, "PDB file format" 3.30, ATOM, TER and REMARK
/// In      X_AB     pose of the ligand's file frame in the receptor's file frame, position [Å]
///         remarks  REMARK lines for the user; bytes other than printable ASCII become '?', long lines are divided
/// Out     coordinates with 3 decimals [Å]
/// Fails   MoleculeError, which names the atom, in these cases:
///         * bytes in a name that are not printable ASCII;
///         * limits of the PDB format, for which mmCIF can be written instead: more than 99,999 atoms and TER records;
///           more than 62 chains; names above 4 letters; chain names above 1 letter; numbers outside -999 … 9999;
///           coordinates outside -999.999 … 9999.999 Å.
///         std::invalid_argument: see docking::residue_starts(); or the pose is not finite
std::string complex_pdb(const docking::Molecule& receptor, const docking::Molecule& ligand, const Pose& X_AB_angstrom,
                        std::span<const std::string> remarks = {});

/// Returns the complex in mmCIF format, as complex_pdb() does in PDB format, but without the limits of PDB. Coordinates
/// have 3 to 6 decimals, and remarks are comments. Each chain, and each part of a chain, has its own label_asym_id. The
/// names, numbers and chains of the molecules are in the auth_… items.
///
/// Fails   MoleculeError: a name that is not printable ASCII or has both kinds of quotes
std::string complex_mmcif(const docking::Molecule& receptor, const docking::Molecule& ligand, const Pose& X_AB_angstrom,
                          std::span<const std::string> remarks = {});

/// Checks the name of the output file; call it before the complex is computed.
///
/// Fails   std::invalid_argument: the name ends neither in .pdb nor in .cif
void check_complex_name(const std::filesystem::path& file);

/// Writes the complex in the format of the file's extension. A temporary file is written first and then renamed, so
/// that a concurrent reader never gets a partial file.
///
/// Fails   MoleculeError naming the file: as complex_pdb() and complex_mmcif(), or a write error
void save_complex(const std::filesystem::path& file, const docking::Molecule& receptor, const docking::Molecule& ligand,
                  const Pose& X_AB_angstrom, std::span<const std::string> remarks = {});

/// Returns remarks with the energies ("Lennard-Jones -12.5, … kJ/mol") and the field model.
std::vector<std::string> energy_remarks(const docking::FieldResult& result, const docking::FieldModel& model);

}  // namespace tandem::server
