// Structure files to molecules: tolerant readers and the parameters of GROMACS's data files.
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

/// What is used where nobody names a force field: `opls`, or where there is no such folder kBuiltInForceField.
std::string default_force_field(const std::filesystem::path& opls = kOplsDirectory);
/// A molecule's note that its parameters are the built-in ones, and how to have OPLS-AA's.
///
/// In      is_installed  whether kOplsDirectory exists
///         is_charged    whether the file has charges
std::string built_in_note(bool is_installed, bool is_charged);

/// What people may want to know of single atoms, beside Molecule::guessed and the counts in Molecule::notes.
struct StructureReport {
  std::vector<std::string> places;      ///< of each atom of the molecule: "CG of VAL 12A of chain B"
  std::vector<std::string> missing;     ///< atoms that the force field expects and the file lacks
  std::vector<std::string> dropped;     ///< atoms and residues of the file that were left out, with the reason
  std::vector<std::string> built;       ///< heavy atoms that were added: OXT at ends of chains
  std::vector<std::string> gaps;        ///< "before GLY 45 of chain A", also a chain's beginning that was cut
  std::vector<std::string> histidines;  ///< of those without hydrogens in the file, which was chosen and why
  std::string hydrogens;                ///< "given", "build" or "united": what was done
  std::vector<std::string> moved;       ///< built hydrogens that overlapped, of the whole file: which, and how far
  std::vector<std::string> clashes;     ///< of the whole file: built hydrogens that still do
  NetCharge charge;                     ///< of what was loaded; with built-in parameters not set
};

/// A structure and how it is to be loaded.
struct StructureSource {
  std::filesystem::path file;
  StructureSelection selection;
  Hydrogens hydrogens = Hydrogens::kAsNeeded;
};

/// Reads what is selected (first model, first alternate location) and gives each atom its type, charge and
/// Lennard-Jones parameters, usually of OPLS-AA. Charges and radii of a PQR file stay its own: σ = 2^(5/6) · radius, and of radius 0 no
/// Lennard-Jones term.
///
/// An atom without an exact entry is typed by its element (residue_typing.hpp) and named in Molecule::guessed; atoms
/// that the file lacks and those left out are counted in Molecule::notes and named in the report.
/// With kBuiltInForceField all atoms have the parameters of their elements and charge 0 (a PQR file's stay its own), and
/// Molecule::notes says so; hydrogens cannot be built.
/// With Hydrogens::kGiven nothing is added: a file without hydrogens gives heavy atoms with all-atom parameters, whose
/// attraction is about a third too weak. Built hydrogens that would overlap other atoms of the file are moved (relax_hydrogens()).
///
/// In      beside  other structures in the frame of this one, as those of a complex in two files; built hydrogens keep clear of their
///                 atoms too. Order and number do not change what else is loaded
/// Source  the parameter files of `force_field_directory` (load_force_field(); GROMACS: ffnonbonded.itp, aminoacids.rtp, …),
///         read at run time: of OPLS-AA, Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225
/// Fails   MoleculeError: file missing or damaged, no atoms left, two atoms on one place, chain or residue not there
///         (names those that are), force field missing (names the Debian package) or mixed otherwise than
///         arithmetically or geometrically; hydrogens other than given with kBuiltInForceField, united with any but OPLS-AA
docking::Molecule load_molecule(const std::filesystem::path& structure, const StructureSelection& selection,
                                const std::filesystem::path& force_field_directory,
                                Hydrogens hydrogens = Hydrogens::kGiven, StructureReport* report = nullptr,
                                std::span<const StructureSource> beside = {});

}  // namespace tandem::server
