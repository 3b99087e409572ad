// Converts structure files to molecules, with tolerant readers and the parameters of GROMACS's data files.
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

/// Default force field: `opls`, or kBuiltInForceField if that folder does not exist.
std::string default_force_field(const std::filesystem::path& opls = kOplsDirectory);
/// Note of a molecule that its parameters are the built-in ones, with the remedy for OPLS-AA.
///
/// In      is_installed  whether kOplsDirectory exists
///         is_charged    whether the file has charges
std::string built_in_note(bool is_installed, bool is_charged);

/// Details of single atoms for the user, beside Molecule::guessed and the counts in Molecule::notes.
struct StructureReport {
  std::vector<std::string> places;      ///< for each atom of the molecule: "CG of VAL 12A of chain B"
  std::vector<std::string> missing;     ///< atoms that the force field expects and the file lacks
  std::vector<std::string> dropped;     ///< atoms and residues of the file that were left out, with the reason
  std::vector<std::string> built;       ///< heavy atoms that were added: OXT at ends of chains
  std::vector<std::string> gaps;        ///< "before GLY 45 of chain A"; also the start of a chain that was cut
  std::vector<std::string> histidines;  ///< for each without hydrogens in the file: the choice and its reason
  std::string hydrogens;                ///< "given", "build" or "united", as applied
  std::vector<std::string> moved;       ///< built hydrogens of the whole file that overlapped: names and displacements
  std::vector<std::string> clashes;     ///< built hydrogens of the whole file that still overlap
  NetCharge charge;                     ///< charge of the loaded atoms; not set with built-in parameters
};

/// A structure file and its loading options.
struct StructureSource {
  std::filesystem::path file;
  StructureSelection selection;
  Hydrogens hydrogens = Hydrogens::kAsNeeded;
};

/// Reads the selection (first model, first alternate location) and gives each atom its type, charge and Lennard-Jones
/// parameters, usually of OPLS-AA. Charges and radii of a PQR file are kept: σ = 2^(5/6) · radius, and an atom of
/// radius 0 has no Lennard-Jones term.
///
/// An atom without an exact entry is typed by its element (residue_typing.hpp) and named in Molecule::guessed. Atoms
/// that the file lacks and atoms that are left out are counted in Molecule::notes and named in the report. With
/// kBuiltInForceField all atoms have the parameters of their elements and charge 0, except for charges and radii of a
/// PQR file. Molecule::notes then says so; hydrogens cannot be built. With Hydrogens::kGiven nothing is added. A file
/// without hydrogens then gives heavy atoms with all-atom parameters, whose attraction is about a third too weak. Built
/// hydrogens that would overlap other atoms of the file are moved (relax_hydrogens()).
///
/// In      beside  other structures in the same frame, such as the other file of a complex; built hydrogens avoid their
///         atoms too. Their order and number do not affect anything else
/// Source  the parameter files of `force_field_directory` (load_force_field(); GROMACS: ffnonbonded.itp,
///         aminoacids.rtp, …), read at run time: of OPLS-AA, Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225
/// Fails   MoleculeError: file missing or damaged; no atoms left; two atoms at one position; chain or residue missing
///         (names the existing ones); force field missing (names the Debian package) or with a combination rule other
///         than arithmetic or geometric; hydrogens other than given with kBuiltInForceField; united with any force
///         field but OPLS-AA
docking::Molecule load_molecule(const std::filesystem::path& structure, const StructureSelection& selection,
                                const std::filesystem::path& force_field_directory,
                                Hydrogens hydrogens = Hydrogens::kGiven, StructureReport* report = nullptr,
                                std::span<const StructureSource> beside = {});

}  // namespace tandem::server
