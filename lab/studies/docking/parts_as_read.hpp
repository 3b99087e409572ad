// Checks that receptor and ligand form a complex in the poses of their files.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "common/base/spatial.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// Heavy atoms nearer than this coincide: the shortest bond, of C and O, has 1.1 Å [Å].
inline constexpr double kOnePlace_angstrom = 0.8;

/// "SG of CYS 7 of chain A"
std::string place_text(const docking::Molecule& molecule, std::size_t atom);

/// The nearest pair of heavy atoms of A and B in the pose `X_AB` [Å]; nullopt if either has none.
/// Cost    all pairs of heavy atoms
std::optional<std::pair<std::size_t, std::size_t>> nearest_atoms(const docking::Molecule& a, const docking::Molecule& b,
                                                                 const Pose& X_AB);

/// "SG of CYS 7 of chain A and SG of CYS 7 of chain B are 2.03 Å apart"
std::string distance_text(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB,
                          std::pair<std::size_t, std::size_t> atoms);

/// The residue of A and the residue of B with the largest Lennard-Jones energies in the pose `X_AB` [Å]:
/// "TRP 12 of chain A (31.2 kcal/mol) and PHE 49 of chain B (28.0 kcal/mol)".
/// Cost    exact_field()
std::string strongest_repulsion_text(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB);

/// Refuses parts that form no native complex for redocking: coincident atoms, a bond between the parts, or no residues
/// within 5 Å. Bonds are found by names and distance: sulphurs within 2.5 Å (a disulphide bridge), C and N (peptide)
/// or O3' and P (nucleic acid) within 1.7 Å.
///
/// Fails   std::invalid_argument naming the atoms, their distance and the remedy
void require_complex_as_read(const docking::Molecule& a, const docking::Molecule& b, const Pose& native_X_AB);

}  // namespace tandem::lab
