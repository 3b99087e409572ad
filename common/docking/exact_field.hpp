// The field in double precision, summed over all pairs of atoms, for energies, reports and tests.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::docking {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Optional results of exact_field(). A null pointer means that the result is not computed.
struct ExactDetails {
  std::vector<Vec3>* forces_on_a = nullptr;  ///< force on each atom of A [kJ/mol/Å], in A's frame
  std::vector<Vec3>* forces_on_b = nullptr;
  /// Derivative ∂(force, torque on B)/∂(displacement [Å], rotation vector [rad] of B about its origin), in A's frame.
  Matrix6* gradient = nullptr;
  /// Lennard-Jones and Coulomb energy of each atom, summed over its pairs [kJ/mol]. The sum over either molecule is the
  /// total energy.
  std::vector<Eigen::Vector2d>* energies_of_a = nullptr;
  std::vector<Eigen::Vector2d>* energies_of_b = nullptr;
  /// Called with the completed fraction after each 1e7 pairs (about 0.4 s), and with 1 at the end. May be empty.
  std::function<void(double done)> progress = {};
};

/// Returns the field of two molecules in double precision, summed over all pairs.
///
/// Model   V = Σ_ij 4 ε_ij [(σ_ij/r)¹² − (σ_ij/r)⁶] + k q_i q_j/(ε_r r) over the atoms i of A and j of B, with
///           ε_ij  well depth √(ε_i ε_j)
///           σ_ij  √(σ_i σ_j), or (σ_i + σ_j)/2 (Molecule::mixes_arithmetically)
///           k, q  Coulomb's constant, charges
///           ε_r   relative permittivity: a constant, or proportional to the distance r
///         Core: the range r < r_c below the core radius r_c. For Lennard-Jones terms r_c is σ_ij/4, where V is 6.7e7
///         ε_ij; for charges it is 0.8 Å. Inside the core V is continued as its tangent in r². The force is then
///         f(r_c)·d/r_c, with the vector d between the atoms. The force of overlapping atoms is therefore huge but
///         finite, and it is the gradient of V. Two coincident atoms have no force, because they define no direction.
///         Cut-off: with a cut-off, each power of r is force-switched (ForceSwitch)
/// Source  Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225: form and geometric mixing. The core is our addition
/// In      X_AB  pose of B's frame in A's, position in Å. The results are zero for a pose that is not finite, not a
///         rotation, or farther than 1e9 Å
/// Fails   throws std::invalid_argument, see validate()
FieldResult exact_field(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom, const FieldModel& model = {},
                        const ExactDetails& details = {});

/// Returns, for each residue, the sum of `atom_energies` over its atoms, in the order of residue_starts().
///
/// Fails   throws std::invalid_argument: see residue_starts(), or if the numbers of energies and atoms differ
std::vector<Eigen::Vector2d> residue_energies(const Molecule& molecule, std::span<const Eigen::Vector2d> atom_energies);

/// Returns whether the field can be evaluated at this pose: it must be finite, a rotation, and within 1e9 Å.
bool is_evaluable(const Pose& X_AB_angstrom);

}  // namespace tandem::docking
