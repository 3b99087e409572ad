// Converts structure files to molecules. The readers tolerate common errors; parameters come from GROMACS's files.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/docking/molecule.hpp"
#include "common/docking/molecule_error.hpp"
#include "server/assets/structures/hydrogens.hpp"
#include "server/assets/structures/net_charge.hpp"
#include "server/assets/structures/structure_file.hpp"

namespace tandem::server {

/// Returns the default force field: `opls`, or kBuiltInForceField if that folder does not exist.
std::string default_force_field(const std::filesystem::path& opls = kOplsDirectory);
/// Returns a note for the user: a molecule has the built-in parameters, and how to get OPLS-AA instead.
///
/// In      is_installed  whether kOplsDirectory exists
///         is_charged    whether the file has charges
std::string built_in_note(bool is_installed, bool is_charged);

/// Details about single atoms for the user, to supplement Molecule::guessed and the counts in Molecule::notes.
struct StructureReport {
  std::vector<std::string> places;   ///< description of each atom of the molecule: "CG of VAL 12A of chain B"
  std::vector<std::string> missing;  ///< atoms that the force field expects and the file lacks
  std::vector<std::string> dropped;  ///< atoms and residues of the file that were not loaded, with the reason
  std::vector<std::string> built;    ///< heavy atoms that were added: OXT at chain ends
  /// Gaps in chains: "before GLY 45 of chain A"; also the ends at which a chain was cut out of a longer one.
  std::vector<std::string> gaps;
  std::vector<std::string> histidines;  ///< choice and reason for each histidine without hydrogens in the file
  std::string hydrogens;                ///< "given", "build" or "united": the applied choice
  std::vector<std::string> moved;       ///< built hydrogens of the whole file that were moved: names and displacements
  std::vector<std::string> clashes;     ///< built hydrogens of the whole file that still overlap
  NetCharge charge;                     ///< charge of the loaded atoms; not computed with built-in parameters
};

/// A structure file and its loading options.
struct StructureSource {
  std::filesystem::path file;
  StructureSelection selection;
  Hydrogens hydrogens = Hydrogens::kAsNeeded;
};

/// Reads the selected residues (first model, one alternate location), and assigns a type, a charge and Lennard-Jones
/// parameters to each atom, usually those of OPLS-AA. Charges and radii of a PQR file are kept: σ = 2^(5/6) · radius,
/// and an atom of radius 0 has no Lennard-Jones term.
///
/// An atom without an exact entry gets a type by its element (residue_typing.hpp) and is listed in Molecule::guessed.
/// Atoms that the file lacks and atoms that are not loaded are counted in Molecule::notes and listed in the report.
///
/// With kBuiltInForceField, all atoms have the parameters of their elements and charge 0, except for charges and radii
/// of a PQR file. A note says so, and hydrogens cannot be built.
///
/// Hydrogens:
/// * With Hydrogens::kGiven nothing is added. The heavy atoms of a file without hydrogens then have all-atom
///   parameters, whose attraction is about a third too weak.
/// * Built hydrogens that would overlap other atoms of the file are moved (relax_hydrogens()).
///
/// In      beside  other structures in the same frame, such as the second file of a complex. They have one effect:
///                 built hydrogens are moved away from their atoms
/// Source  the parameter files of `force_field_directory` (load_force_field(); GROMACS: ffnonbonded.itp,
///         aminoacids.rtp, …), read at run time: of OPLS-AA, Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225
/// Fails   MoleculeError in these cases:
///         * A file is missing or damaged.
///         * No atoms remain, or two atoms are at one position.
///         * A chain or residue is missing; the message names the existing ones.
///         * The force field is missing (the message names the Debian package), or its combination rule is neither
///           arithmetic nor geometric.
///         * `hydrogens` is not kGiven, and the force field is kBuiltInForceField, which cannot build hydrogens.
///         * `hydrogens` is kUnited, and the force field is not OPLS-AA.
docking::Molecule load_molecule(const std::filesystem::path& structure, const StructureSelection& selection,
                                const std::filesystem::path& force_field_directory,
                                Hydrogens hydrogens = Hydrogens::kGiven, StructureReport* report = nullptr,
                                std::span<const StructureSource> beside = {});

}  // namespace tandem::server
