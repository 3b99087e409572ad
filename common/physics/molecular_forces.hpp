// The molecular field as the world's bodies feel it: newtons and metres outside, kJ/mol and Å inside.
#pragma once

#include <span>
#include <vector>

#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// `magnitude` bounded by `limit`: itself up to half the limit, then approaching the limit; once continuously
/// differentiable, so that a hand feels no edge.
double soft_limit(double magnitude, double limit);

/// s(E): the share of a pair's force and torque that is felt, by its energy alone, so that it stays conservative.
///
/// Model   s = z · 1/√(1 + x²). z is 0 up to E_min + n kT and goes to 1 over one kT more as 3u² − 2u³ does (1 without a
///         zero area); x = (E − E_knee)/w above the knee, 0 below. w makes a repulsion r^−12, whose force grows with its
///         energy, come to about a quarter of the force limit: felt energy grows as the logarithm of overlap
/// Source  ours; a scale that depends on the pose in any other way makes energy on closed paths
double felt_share(const WorldDescription& world, double energy_kcal_per_mol);
/// ∫ s dE, at 0 where the molecules are apart, if the zero area and the knee are not.
double felt_energy_kcal_per_mol(const WorldDescription& world, double energy_kcal_per_mol);

/// Forces between every two bodies with a molecule.
///
/// Model   x [m] = S_x · x [Å], f [N] = s(E) · S_f · f [kcal/mol/Å], τ [N·m] = s(E) · S_f · S_x · τ [kcal/mol]. Should
///         √(|f|² + (|τ_a|² + |τ_b|²)/(2L²)) still come above half the scene's force limit, L being the pair's mean radius
///         of gyration, both are bounded by it together: directions are kept, and action equals reaction, but there the
///         field is not conservative.
class MolecularForces {
 public:
  /// In      world  outlives this
  explicit MolecularForces(const WorldDescription& world);
  ~MolecularForces();

  /// Adds each body's wrench about its origin. True when a pair had to be bounded.
  /// In      X_WB, wrenches_W  one a body of the scene
  /// Cost    the pairs of atoms; no allocation
  bool add_wrenches(std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept;

  /// Sum of the pairs at the last add_wrenches().
  double energy_kj_per_mol() const { return energy_kj_per_mol_; }
  /// Of what is felt of them, in the world's joules.
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
