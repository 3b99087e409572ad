// A rigid molecule for the field: atom positions, Lennard-Jones parameters, charges. This folder uses Å, kJ/mol and e;
// physics::MolecularForces converts to metres and newtons.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::docking {

/// Atoms with parameters; positions in the file's frame.
struct Molecule {
  std::vector<Vec3> positions_angstrom;
  std::vector<double> sigma_angstrom;
  std::vector<double> epsilon_kj_per_mol;
  std::vector<double> charge_e;
  std::vector<double> mass_u;
  std::vector<std::string> atom_names;     ///< "CA"
  std::vector<std::string> elements;       ///< upper case: "C", "ZN"
  std::vector<std::string> residue_names;  ///< residue name per atom, "GLU"
  std::vector<std::string> residue_ids;    ///< residue number and insertion code per atom, "12A"
  std::vector<std::string> chains;         ///< chain per atom, "B"; empty if the file names none
  std::vector<int> segments;               ///< per atom: number of chain ends before it in the file
  std::vector<std::string> types;          ///< force-field type of each atom, "opls_238"
  /// Atoms for which the force field has no exact entry, each with a notice to the user: atom, residue, stand-in.
  std::map<std::size_t, std::string> guessed;
  std::vector<std::string> notes;  ///< other notices of the loader to the user: omitted or missing atoms
  std::string force_field;         ///< e.g. "oplsaa"
  /// The force field's mixing rule: σ_ij = (σ_i + σ_j)/2 instead of √(σ_i σ_j). One such molecule suffices for a pair.
  bool mixes_arithmetically = false;

  std::size_t size() const { return positions_angstrom.size(); }
  Vec3 centre_of_mass_angstrom() const;
  /// Moves all atoms so that their centre of mass is the origin.
  /// Out     previous centre of mass
  Vec3 centre();
  /// Radius about the origin, with equal weights; at least 1 Å, a bond's length, because a single atom has no extent.
  double gyration_radius_angstrom() const;
};

/// Index of the first atom of each residue, ascending. A residue is a run of atoms with one chain, residue and segment.
///
/// Fails   std::invalid_argument: an atom without name or residue
std::vector<std::size_t> residue_starts(const Molecule& molecule);

/// Refuses values that the field kernels cannot bound: arrays of unequal length, coordinates not finite or beyond 1e6
/// Å, σ other than 0 or 0.1 … 20 Å, ε outside 0 … 1e4 kJ/mol, charges beyond 100 e.
///
/// Fails   std::invalid_argument naming the atom, the value and the range
void validate(const Molecule& molecule);

inline constexpr double kKilojoulesPerKilocalorie = 4.184;
/// kT at 298.15 K.
inline constexpr double kThermalEnergy_kcal_per_mol = 0.592484;

}  // namespace tandem::docking
