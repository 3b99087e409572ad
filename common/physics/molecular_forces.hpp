// Molecular field between the world's bodies. Converts between the world's units (N, m) and those of the field (kJ/mol,
// Å).
#pragma once

#include <span>
#include <vector>

#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// Limits `magnitude` smoothly. It is unchanged up to half of `limit`, and then approaches `limit`. The function has a
/// continuous derivative, so the user feels no edge.
double soft_limit(double magnitude, double limit);

/// Returns the displayed fraction s(E) of the force and torque between two molecules. The fraction depends only on
/// their energy E, so the displayed field remains conservative.
///
/// Model   s = z · 1/√(1 + x²). z makes the force zero in the zero area, and x reduces it above the knee.
///         Zero area: at energies up to E_min + n kT, z is 0 and no force is displayed, so that a hand can rest there.
///         E_min and n are molecular_minimum_kcal_per_mol and molecular_zero_kt of WorldDescription. Over one further
///         kT, z rises to 1 as 3u² − 2u³, where u is the energy above the zero area in kT. Without a zero area z is 1.
///         Knee: above the energy E_knee, x = (E − E_knee)/w; below it x is 0. The width w is chosen such that the
///         displayed force of a repulsion r^−12 approaches about a quarter of the force limit. The displayed energy
///         then grows only as the logarithm of the overlap
/// Source  our derivation. If s depended on the pose other than through the energy, closed paths would create energy
double felt_share(const WorldDescription& world, double energy_kcal_per_mol);
/// Returns the displayed energy: the integral of s dE. For molecules far apart the energy E is 0, and so is the
/// displayed energy, unless E = 0 lies in the zero area or above the knee.
double felt_energy_kcal_per_mol(const WorldDescription& world, double energy_kcal_per_mol);

/// Molecular forces between all pairs of bodies that have a molecule.
///
/// Model   Scales: lengths x [m] = S_x · x [Å], forces f [N] = s(E) · S_f · f [kcal/mol/Å], and torques τ [N·m] = s(E)
///         · S_f · S_x · τ [kcal/mol]. S_x and S_f are the scene's scales, and s is felt_share().
///         Limit: √(|f|² + (|τ_a|² + |τ_b|²)/(2L²)) measures the load on a pair of molecules a and b, where L is their
///         mean radius of gyration. If the load exceeds half of the scene's force limit, f and τ are scaled down by the
///         same factor. Directions are unchanged and the third law holds, but in this range the field is not
///         conservative.
class MolecularForces {
 public:
  /// In      world  must outlive this object
  explicit MolecularForces(const WorldDescription& world);
  ~MolecularForces();

  /// Adds the wrench on each body about its origin. Returns true if the wrench of a pair was limited.
  /// In      X_WB, wrenches_W  one entry for each body of the scene
  /// Cost    linear in the number of atom pairs; no allocation
  bool add_wrenches(std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept;

  /// Energy of all pairs at the last add_wrenches().
  double energy_kj_per_mol() const { return energy_kj_per_mol_; }
  /// Displayed energy of all pairs, in joules of the world.
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
