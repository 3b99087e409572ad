#include "common/physics/molecular_forces.hpp"

#include <algorithm>
#include <cmath>

#include "common/docking/molecular_field.hpp"

namespace tandem::physics {
namespace {

double gyration_radius_angstrom(const docking::Molecule& molecule) {
  double sum = 0;
  for (const Vec3& position : molecule.positions_angstrom) sum += position.squaredNorm();
  // At least a bond's length: a single atom has no extent, and no lever.
  return std::max(1.0, std::sqrt(sum / static_cast<double>(molecule.size())));
}

}  // namespace

double soft_limit(double magnitude, double limit) {
  const double knee = 0.5 * limit;
  if (magnitude <= knee) return magnitude;
  return limit - (limit - knee) * std::exp(-(magnitude - knee) / (limit - knee));
}

/// Two bodies with a molecule.
struct MolecularForces::Pair {
  std::size_t a = 0;
  std::size_t b = 0;
  docking::MolecularField field;
  double gyration_radius_m = 0;
  double energy_kj_per_mol = 0;
};

MolecularForces::MolecularForces(const WorldDescription& world)
    : metres_per_angstrom_(world.metres_per_angstrom),
      newtons_per_kcal_per_mol_angstrom_(world.newtons_per_kcal_per_mol_angstrom),
      force_limit_n_(world.molecular_force_limit_n) {
  for (std::size_t a = 0; a < world.bodies.size(); ++a) {
    for (std::size_t b = a + 1; b < world.bodies.size(); ++b) {
      if (!world.bodies[a].molecule || !world.bodies[b].molecule) continue;
      const docking::Molecule& molecule_a = *world.bodies[a].molecule;
      const docking::Molecule& molecule_b = *world.bodies[b].molecule;
      const double radius = 0.5 * (gyration_radius_angstrom(molecule_a) + gyration_radius_angstrom(molecule_b));
      pairs_.push_back({a, b, docking::MolecularField(molecule_a, molecule_b), radius * metres_per_angstrom_, 0});
    }
  }
}

MolecularForces::~MolecularForces() = default;

bool MolecularForces::add_wrenches(std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept {
  bool is_limited = false;
  energy_kj_per_mol_ = 0;
  for (Pair& pair : pairs_) {
    is_limited |= add_pair(pair, X_WB, wrenches_W);
    energy_kj_per_mol_ += pair.energy_kj_per_mol;
  }
  return is_limited;
}

double MolecularForces::energy_j() const {
  return newtons_per_kcal_per_mol_angstrom_ * metres_per_angstrom_ * energy_kj_per_mol_ /
         docking::kKilojoulesPerKilocalorie;
}

bool MolecularForces::add_pair(Pair& pair, std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept {
  const Pose X_AB = X_WB[pair.a].inverse() * X_WB[pair.b];
  const docking::FieldResult result = pair.field.evaluate({X_AB.p / metres_per_angstrom_, X_AB.q});
  // Atoms on top of each other: the field has no value there. The last energy stays; nothing pushes.
  if (!std::isfinite(result.energy_kj_per_mol()) || !is_finite(result.force_on_b) || !is_finite(result.torque_on_b)) {
    return true;
  }
  pair.energy_kj_per_mol = result.energy_kj_per_mol();
  const double newtons = newtons_per_kcal_per_mol_angstrom_ / docking::kKilojoulesPerKilocalorie;
  const Vec3 f_b = newtons * result.force_on_b;
  const Vec3 t_b = newtons * metres_per_angstrom_ * result.torque_on_b;
  const Vec3 t_a = -t_b - X_AB.p.cross(f_b);

  const double twist = (t_a.squaredNorm() + t_b.squaredNorm()) / (2 * pair.gyration_radius_m * pair.gyration_radius_m);
  const double magnitude = std::sqrt(f_b.squaredNorm() + twist);
  const double bounded = soft_limit(magnitude, force_limit_n_);
  const double factor = magnitude > 0 ? bounded / magnitude : 1.0;
  const Quat& q_WA = X_WB[pair.a].q;
  wrenches_W[pair.a] += Wrench{q_WA * (-factor * f_b), q_WA * (factor * t_a)};
  wrenches_W[pair.b] += Wrench{q_WA * (factor * f_b), q_WA * (factor * t_b)};
  return bounded < magnitude;
}

}  // namespace tandem::physics
