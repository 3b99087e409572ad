// The field in double precision over all pairs, for energies, reports and checks.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::docking {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Optional results of exact_field(); null: not computed.
struct ExactDetails {
  std::vector<Vec3>* forces_on_a = nullptr;  ///< per atom, kJ/mol/Å, in A's frame
  std::vector<Vec3>* forces_on_b = nullptr;
  /// ∂(force, torque on B)/∂(displacement [Å], rotation vector [rad] of B about its origin, in A's frame).
  Matrix6* gradient = nullptr;
  /// Per atom: Lennard-Jones and Coulomb energy of its pairs [kJ/mol]; the sum over either molecule is the total.
  std::vector<Eigen::Vector2d>* energies_of_a = nullptr;
  std::vector<Eigen::Vector2d>* energies_of_b = nullptr;
  /// Called after each 1e7 pairs, about 0.4 s, with the completed share, and with 1 at the end; may be empty.
  std::function<void(double done)> progress = {};
};

/// Field of two molecules in double precision, over all pairs.
///
/// Model   V = Σ_ij 4 ε_ij [(σ_ij/r)¹² − (σ_ij/r)⁶] + k q_i q_j/(ε r), ε_ij = √(ε_i ε_j), σ_ij = √(σ_i σ_j) or (σ_i +
///         σ_j)/2 (Molecule::mixes_arithmetically); ε a constant or ∝ r. Inside the core, V continues along its tangent
///         in r², so f = f(r_c)·d/r_c. The core is r < σ_ij/4, where V exceeds 3e7 ε; for charges r < 0.8 Å. Overlap
///         thus gives a huge but finite force, still the gradient of V. Two coincident atoms have no direction and give
///         no force. With a cut-off each power of r is force-switched.
/// Source  Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225: form and geometric mixing; the core is ours
/// In      X_AB  pose of B's frame in A's, position in Å; a pose that is not finite, not a rotation or farther than 1e9
///         Å gives zeros
/// Fails   std::invalid_argument, see validate()
FieldResult exact_field(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom, const FieldModel& model = {},
                        const ExactDetails& details = {});

/// Sums of these energies over the atoms of each residue, in the order of residue_starts().
///
/// Fails   std::invalid_argument: see residue_starts(), or the number of energies is not that of atoms
std::vector<Eigen::Vector2d> residue_energies(const Molecule& molecule, std::span<const Eigen::Vector2d> atom_energies);

/// Returns whether the field is evaluated at this pose: finite, a rotation, within 1e9 Å.
bool is_evaluable(const Pose& X_AB_angstrom);

}  // namespace tandem::docking
