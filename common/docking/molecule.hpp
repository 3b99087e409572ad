// A rigid molecule, as the force field between two molecules (MolecularField) requires it: atom positions,
// Lennard-Jones parameters, charges. This folder uses the units Å, kJ/mol and e; physics::MolecularForces converts them
// to metres and newtons.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::docking {

/// Atoms with their parameters, one array per property; positions are in the frame of the structure file.
struct Molecule {
  std::vector<Vec3> positions_angstrom;
  std::vector<double> sigma_angstrom;
  std::vector<double> epsilon_kj_per_mol;
  std::vector<double> charge_e;
  std::vector<double> mass_u;
  std::vector<std::string> atom_names;     ///< name of each atom, such as "CA"
  std::vector<std::string> elements;       ///< element of each atom in upper case: "C", "ZN"
  std::vector<std::string> residue_names;  ///< name of each atom's residue, such as "GLU"
  std::vector<std::string> residue_ids;    ///< residue number and insertion code of each atom, such as "12A"
  std::vector<std::string> chains;         ///< chain of each atom, such as "B"; empty if the file gives none
  std::vector<int> segments;               ///< number of chain ends (such as TER records) before each atom in the file
  std::vector<std::string> types;          ///< force-field type of each atom, such as "opls_238"
  /// Atoms for which the force field has no exact entry. The text for each atom is a notice to the user that names the
  /// atom, its residue, and the parameters used instead.
  std::map<std::size_t, std::string> guessed;
  std::vector<std::string> notes;  ///< further notices of the loader to the user, about omitted or missing atoms
  std::string force_field;         ///< name of the force field, such as "oplsaa"
  /// Mixing rule of the force field: true for σ_ij = (σ_i + σ_j)/2, false for √(σ_i σ_j). For two molecules the
  /// arithmetic rule applies if either of them has it.
  bool mixes_arithmetically = false;

  std::size_t size() const { return positions_angstrom.size(); }
  Vec3 centre_of_mass_angstrom() const;
  /// Moves all atoms so that their centre of mass is at the origin.
  /// Out     the centre of mass before the call
  Vec3 centre();
  /// Radius of gyration about the origin, with equal weights of all atoms. The result is at least 1 Å, about the length
  /// of a bond, because a single atom has no extent.
  double gyration_radius_angstrom() const;
};

/// Returns the index of the first atom of each residue, ascending. A residue consists of consecutive atoms with equal
/// chain, residue and segment.
///
/// Fails   throws std::invalid_argument if an atom has no name or residue
std::vector<std::size_t> residue_starts(const Molecule& molecule);

/// Checks that the field kernels are valid for the molecule. Invalid are: arrays of unequal length, coordinates that
/// are not finite or beyond 1e6 Å, σ other than 0 or 0.1 … 20 Å, ε outside 0 … 1e4 kJ/mol, and charges beyond 100 e.
///
/// Fails   throws std::invalid_argument naming the atom, the value and the range
void validate(const Molecule& molecule);

inline constexpr double kKilojoulesPerKilocalorie = 4.184;
/// Thermal energy kT (Boltzmann's constant times temperature) at 298.15 K.
inline constexpr double kThermalEnergy_kcal_per_mol = 0.592484;

}  // namespace tandem::docking
