// Molecular field for the world's bodies: newtons and metres outside, kJ/mol and Å inside.
#pragma once

#include <span>
#include <vector>

#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// Bounds `magnitude` by `limit`: unchanged up to half the limit, then approaching the limit. It is once continuously
/// differentiable, so a hand feels no edge.
double soft_limit(double magnitude, double limit);

/// Share s(E) of a pair's force and torque that is felt. It depends on the pair's energy only, so the field stays
/// conservative.
///
/// Model   s = z · 1/√(1 + x²). z is 0 up to E_min + n kT and rises to 1 over one more kT as 3u² − 2u³; without a zero
///         area it is 1. x = (E − E_knee)/w above the knee, 0 below. With this w, a repulsion r^−12, whose force grows
///         with its energy, approaches about a quarter of the force limit. The felt energy then grows as the logarithm
///         of overlap
/// Source  ours; a scale that depends on the pose in any other way creates energy on closed paths
double felt_share(const WorldDescription& world, double energy_kcal_per_mol);
/// Integral ∫ s dE. It is 0 where the molecules are apart, if neither the zero area nor the knee includes that energy.
double felt_energy_kcal_per_mol(const WorldDescription& world, double energy_kcal_per_mol);

/// Molecular forces between all pairs of bodies with a molecule.
///
/// Model   x [m] = S_x · x [Å], f [N] = s(E) · S_f · f [kcal/mol/Å], τ [N·m] = s(E) · S_f · S_x · τ [kcal/mol]. L is
///         the pair's mean radius of gyration. If √(|f|² + (|τ_a|² + |τ_b|²)/(2L²)) exceeds half the scene's force
///         limit, both are scaled down together. Directions are kept and action equals reaction, but there the field is
///         not conservative.
class MolecularForces {
 public:
  /// In      world  must outlive this object
  explicit MolecularForces(const WorldDescription& world);
  ~MolecularForces();

  /// Adds each body's wrench about its origin. Returns true when a pair had to be bounded.
  /// In      X_WB, wrenches_W  one for each body of the scene
  /// Cost    linear in the pairs of atoms; no allocation
  bool add_wrenches(std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept;

  /// Energy of all pairs at the last add_wrenches().
  double energy_kj_per_mol() const { return energy_kj_per_mol_; }
  /// Felt energy of all pairs, in the world's joules.
  double energy_j() const;

 private:
  struct Pair;

  bool add_pair(Pair& pair, std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept;

  const WorldDescription* world_;
  std::vector<Pair> pairs_;
  double energy_kj_per_mol_ = 0;
  double felt_kcal_per_mol_ = 0;
};

}  // namespace tandem::physics
