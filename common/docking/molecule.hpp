// A rigid molecule as the field sees it: atom positions, Lennard-Jones parameters, charges. Å, kJ/mol and e inside
// this folder; metres and newtons begin at physics::MolecularForces.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::docking {

/// Atoms with parameters, positions in the file's frame.
struct Molecule {
  std::vector<Vec3> positions_angstrom;
  std::vector<double> sigma_angstrom;
  std::vector<double> epsilon_kj_per_mol;
  std::vector<double> charge_e;
  std::vector<double> mass_u;
  std::vector<std::string> atom_names;     ///< "CA"
  std::vector<std::string> elements;       ///< upper case: "C", "ZN"
  std::vector<std::string> residue_names;  ///< of the residue that each atom is in, "GLU"
  std::vector<std::string> residue_ids;    ///< likewise: number and insertion code, "12A"
  std::vector<std::string> chains;         ///< likewise: "B"; empty where the file names none
  std::vector<int> segments;               ///< likewise: counts the ends of chains before it in the file
  std::vector<std::string> types;          ///< force-field type of each atom, "opls_238"
  /// Atoms for which the force field has no exact entry, each with what people should know: atom, residue, stand-in.
  std::map<std::size_t, std::string> guessed;
  std::vector<std::string> notes;  ///< what else the loader saw and people should know: atoms left out or missing
  std::string force_field;         ///< e.g. "oplsaa"
  /// The force field's mixing: σ_ij = (σ_i + σ_j)/2 in place of √(σ_i σ_j). Two molecules mix so where either does.
  bool mixes_arithmetically = false;

  std::size_t size() const { return positions_angstrom.size(); }
  Vec3 centre_of_mass_angstrom() const;
  /// Moves all atoms so that their centre of mass is the origin.
  /// Out     where it was
  Vec3 centre();
  /// About the origin, all atoms alike; 1 at least, a bond's length: a single atom has no extent, and no lever.
  double gyration_radius_angstrom() const;
};

/// The first atom of each residue, ascending: of each run of atoms with one chain, residue and segment.
///
/// Fails   std::invalid_argument: an atom without name or residue
std::vector<std::size_t> residue_starts(const Molecule& molecule);

/// Refuses what the field kernels cannot bound: arrays of unequal length, coordinates not finite or beyond 1e6 Å,
/// σ other than 0 or 0.1 … 20 Å, ε outside 0 … 1e4 kJ/mol, charges beyond 100 e.
///
/// Fails   std::invalid_argument naming the atom, the value and the range
void validate(const Molecule& molecule);

inline constexpr double kKilojoulesPerKilocalorie = 4.184;
/// kT at 298.15 K.
inline constexpr double kThermalEnergy_kcal_per_mol = 0.592484;

}  // namespace tandem::docking
