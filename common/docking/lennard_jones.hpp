// The Lennard-Jones interaction of two rigid molecules: exact over all pairs, no cut-off.
#pragma once

#include <cstddef>
#include <memory>
#include <string_view>
#include <vector>

#include "common/docking/molecule.hpp"

namespace tandem::docking {

/// Energy, and what molecule B feels, expressed in A's frame; A feels the opposite force.
struct FieldResult {
  double energy_kj_per_mol = 0;
  Vec3 force_on_b = Vec3::Zero();   ///< kJ/mol/Å
  Vec3 torque_on_b = Vec3::Zero();  ///< kJ/mol, about the origin of B's frame
};

/// Double precision, per-atom forces: for energies, reports and checks.
///
/// Model   V = Σ_ij 4 ε_ij [(σ_ij/r)¹² − (σ_ij/r)⁶], ε_ij = √(ε_i ε_j), σ_ij = √(σ_i σ_j)
///         Inside the core r < r_c = σ_ij/4 (V there is above 3e7 ε) V goes on as the parabola with the value and the
///         slope of r_c, so f = f(r_c)·d/r_c: overlap gives a huge but finite force, still the gradient of V, and
///         two coincident atoms, between which no direction exists, give none.
/// Source  Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225: form and geometric mixing; the core is ours
/// In      X_AB  pose of B's frame in A's, position in Å; one that is not finite, not a rotation or farther than
///               1e9 Å gives zeros
///         forces_on_a, forces_on_b  filled when not null, kJ/mol/Å, in A's frame
/// Fails   std::invalid_argument, see validate()
FieldResult lennard_jones_exact(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom,
                                std::vector<Vec3>* forces_on_a = nullptr, std::vector<Vec3>* forces_on_b = nullptr);

/// The 1 kHz path: pair terms in float, sums in double, arrays laid out and padded once, one fixed order
/// of summation per kernel. The same model as lennard_jones_exact(), core included.
///
/// Cost    pair_count() pairs, no allocation in evaluate(); README.md has measured rates
/// Thread  any, one at a time per object
class LennardJonesField {
 public:
  /// `kernel`: "" picks the widest that the CPU has; or a name of available_kernels().
  /// Throws std::invalid_argument for another name, or see validate().
  LennardJonesField(const Molecule& a, const Molecule& b, std::string_view kernel = "");
  ~LennardJonesField();
  LennardJonesField(LennardJonesField&&) noexcept;
  LennardJonesField& operator=(LennardJonesField&&) noexcept;

  FieldResult evaluate(const Pose& X_AB_angstrom) noexcept;
  std::string_view kernel() const;
  /// Pairs that evaluate() computes: atoms without a Lennard-Jones term (polar hydrogens) are left out.
  std::size_t pair_count() const;

  /// Names of the kernels this CPU can run, widest first; "portable" is always the last.
  static std::vector<std::string_view> available_kernels();
  /// From now on "" picks this kernel in the whole process; "": the widest again. Before fields are made.
  /// Throws std::invalid_argument for a name that is not one of available_kernels().
  /// Thread  any
  static void use_by_default(std::string_view kernel);
  /// What "" picks.
  static std::string_view default_kernel();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::docking
