// The field in double precision over all pairs: for energies, reports and checks.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::docking {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// What exact_field() fills beside its result; null: left out.
struct ExactDetails {
  std::vector<Vec3>* forces_on_a = nullptr;  ///< one an atom, kJ/mol/Å, in A's frame
  std::vector<Vec3>* forces_on_b = nullptr;
  /// ∂(force, torque on B)/∂(displacement [Å], rotation vector [rad] of B about its origin, in A's frame).
  Matrix6* gradient = nullptr;
  /// One an atom: Lennard-Jones and Coulomb of its pairs [kJ/mol], so that those of either molecule sum to the result's.
  std::vector<Eigen::Vector2d>* energies_of_a = nullptr;
  std::vector<Eigen::Vector2d>* energies_of_b = nullptr;
  /// Called after each 1e7 pairs, some 0.4 s, with the part that is done, and with 1 at the end; empty: not.
  std::function<void(double done)> progress = {};
};

/// Double precision, all pairs.
///
/// Model   V = Σ_ij 4 ε_ij [(σ_ij/r)¹² − (σ_ij/r)⁶] + k q_i q_j/(ε r), ε_ij = √(ε_i ε_j), σ_ij = √(σ_i σ_j) or
///         (σ_i + σ_j)/2 (Molecule::mixes_arithmetically);
///         ε a constant or ∝ r. Inside the core, r < σ_ij/4 (V there is above 3e7 ε) and for charges r < 0.8 Å, V goes
///         on in r² along its tangent, so f = f(r_c)·d/r_c: overlap gives a huge but finite force, still the
///         gradient of V, and two coincident atoms, between which no direction exists, give none. With a cut-off each
///         power of r is force-switched.
/// Source  Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225: form and geometric mixing; the core is ours
/// In      X_AB  pose of B's frame in A's, position in Å; one that is not finite, not a rotation or farther than
///               1e9 Å gives zeros
/// Fails   std::invalid_argument, see validate()
FieldResult exact_field(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom, const FieldModel& model = {},
                        const ExactDetails& details = {});

/// Sums of such energies over the atoms of each residue, in the order of residue_starts().
///
/// Fails   std::invalid_argument: see residue_starts(), or not one energy an atom
std::vector<Eigen::Vector2d> residue_energies(const Molecule& molecule, std::span<const Eigen::Vector2d> atom_energies);

/// Whether a field is evaluated there: finite, a rotation, within 1e9 Å.
bool is_evaluable(const Pose& X_AB_angstrom);

}  // namespace tandem::docking
