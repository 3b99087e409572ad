// Checks that receptor and ligand form a complex in the poses that their files contain.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "common/base/spatial.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// Distance below which two heavy atoms count as being at the same position [Å]. It is shorter than any bond: the
/// shortest one, between C and O, has 1.1 Å.
inline constexpr double kOnePlace_angstrom = 0.8;

/// Returns a description of an atom, e.g. "SG of CYS 7 of chain A".
std::string place_text(const docking::Molecule& molecule, std::size_t atom);

/// Returns the nearest pair of heavy atoms of A and B in the pose `X_AB` [Å], or nullopt if either molecule has none.
/// Cost    loops over all pairs of heavy atoms
std::optional<std::pair<std::size_t, std::size_t>> nearest_atoms(const docking::Molecule& a, const docking::Molecule& b,
                                                                 const Pose& X_AB);

/// Returns a description of a distance, e.g. "SG of CYS 7 of chain A and SG of CYS 7 of chain B are 2.03 Å apart".
std::string distance_text(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB,
                          std::pair<std::size_t, std::size_t> atoms);

/// Returns a description of the residue of A and the residue of B with the largest Lennard-Jones energies in the pose
/// `X_AB` [Å], e.g. "TRP 12 of chain A (31.2 kcal/mol) and PHE 49 of chain B (28.0 kcal/mol)".
/// Cost    one evaluation of exact_field()
std::string strongest_repulsion_text(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB);

/// Throws if the two parts form no native complex that can be redocked. There are three cases:
/// * Two atoms are at the same position.
/// * No residues of the two parts are within 5 Å of each other.
/// * The parts are bonded. Bonds are detected by atom names and distance: two sulphur atoms within 2.5 Å (a disulphide
///   bridge), or C and N (a peptide bond) or O3' and P (a nucleic acid) within 1.7 Å.
///
/// Fails   std::invalid_argument that names the atoms, their distance and the remedy
void require_complex_as_read(const docking::Molecule& a, const docking::Molecule& b, const Pose& native_X_AB);

}  // namespace tandem::lab
