// The molecular field as the world's bodies feel it: newtons and metres outside, kJ/mol and Å inside.
#pragma once

#include <span>
#include <vector>

#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// `magnitude` bounded by `limit`: itself up to half the limit, then approaching the limit; once continuously
/// differentiable, so that a hand feels no edge.
double soft_limit(double magnitude, double limit);

/// Lennard-Jones forces between every two bodies with a molecule.
///
/// Model   x [m] = S_x · x [Å], f [N] = S_f · f [kcal/mol/Å], τ [N·m] = S_f · S_x · τ [kcal/mol]. Force and both
///         torques of a pair are scaled down together so that √(|f|² + (|τ_a|² + |τ_b|²)/(2L²)) stays below the
///         scene's force limit, L being the pair's mean radius of gyration: overlap can then neither push nor twist
///         without bound, directions are kept, and action equals reaction. The scaled field is not conservative; below
///         half the limit it is exact.
class MolecularForces {
 public:
  explicit MolecularForces(const WorldDescription& world);
  ~MolecularForces();

  /// Adds each body's wrench about its origin. True when a pair had to be bounded.
  /// In      X_WB, wrenches_W  one a body of the scene
  /// Cost    the pairs of atoms; no allocation
  bool add_wrenches(std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept;

  /// Sum of the pairs at the last add_wrenches(), unbounded field.
  double energy_kj_per_mol() const { return energy_kj_per_mol_; }
  /// The same in the world's joules.
  double energy_j() const;

 private:
  struct Pair;

  bool add_pair(Pair& pair, std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept;

  double metres_per_angstrom_;
  double newtons_per_kcal_per_mol_angstrom_;
  double force_limit_n_;
  std::vector<Pair> pairs_;
  double energy_kj_per_mol_ = 0;
};

}  // namespace tandem::physics
