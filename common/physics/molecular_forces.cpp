#include "common/physics/molecular_forces.hpp"

#include <algorithm>
#include <cmath>

#include "common/docking/molecular_field.hpp"

namespace tandem::physics {
namespace {

constexpr double kKt_kcal_per_mol = docking::kThermalEnergy_kcal_per_mol;
/// Assumed relative growth of a repulsive energy per Å of overlap, above the knee (see felt_share()). A repulsion r^−12
/// grows by 4/Å at r = 3 Å. Less an attraction, the energy grows faster; the chosen value covers this case, too.
constexpr double kSteepness_per_angstrom = 8;
constexpr double kMinScale = 1e-12;

/// Returns the upper end of the zero area: the energy up to which the displayed force is zero.
double zero_end(const WorldDescription& world) {
  return world.molecular_minimum_kcal_per_mol + world.molecular_zero_kt * kKt_kcal_per_mol;
}

/// Returns the energy of the knee, above which forces are reduced. It is at least 1 kT above the zero area.
double knee(const WorldDescription& world) {
  const double knee = world.molecular_knee_kcal_per_mol;
  return world.molecular_zero_kt > 0 ? std::max(knee, zero_end(world) + kKt_kcal_per_mol) : knee;
}

/// Returns the width w of the knee in felt_share(). With this width, the displayed force of a repulsion approaches
/// about a quarter of the force limit, if the repulsion grows by kSteepness_per_angstrom.
double knee_width(const WorldDescription& world) {
  const double newtons = std::max(kMinScale, world.newtons_per_kcal_per_mol_angstrom);
  return kKneeOfLimit * world.molecular_force_limit_n / (kSteepness_per_angstrom * newtons);
}

}  // namespace

double felt_share(const WorldDescription& world, double energy_kcal_per_mol) {
  double share = 1;
  if (world.molecular_zero_kt > 0) {
    const double u = std::clamp((energy_kcal_per_mol - zero_end(world)) / kKt_kcal_per_mol, 0.0, 1.0);
    share = u * u * (3 - 2 * u);
  }
  const double x = (energy_kcal_per_mol - knee(world)) / knee_width(world);
  return x > 0 ? share / std::sqrt(1 + x * x) : share;
}

double felt_energy_kcal_per_mol(const WorldDescription& world, double energy_kcal_per_mol) {
  double felt = energy_kcal_per_mol;
  if (world.molecular_zero_kt > 0) {
    const double u = std::max(0.0, (energy_kcal_per_mol - zero_end(world)) / kKt_kcal_per_mol);
    // The displayed energy is constant in the zero area, where no force acts. Above it, the force fades in over 1 kT,
    // so the displayed energy grows by only half a kT there. The constant value is zero_end() plus this half, so that
    // the displayed energy equals the true one above the transition.
    felt = zero_end(world) + kKt_kcal_per_mol * (u < 1 ? 0.5 + u * u * u * (1 - u / 2) : u);
  }
  const double above = energy_kcal_per_mol - knee(world);
  const double width = knee_width(world);
  return above > 0 ? felt - above + width * std::asinh(above / width) : felt;
}

double soft_limit(double magnitude, double limit) {
  const double knee = 0.5 * limit;
  if (magnitude <= knee) return magnitude;
  return limit - (limit - knee) * std::exp(-(magnitude - knee) / (limit - knee));
}

/// Two bodies that both have a molecule, with the field between these molecules.
struct MolecularForces::Pair {
  std::size_t a = 0;
  std::size_t b = 0;
  docking::MolecularField field;
  double gyration_radius_m = 0;
  double energy_kj_per_mol = 0;
  double felt_kcal_per_mol = 0;
};

MolecularForces::MolecularForces(const WorldDescription& world) : world_(&world) {
  for (std::size_t a = 0; a < world.bodies.size(); ++a) {
    for (std::size_t b = a + 1; b < world.bodies.size(); ++b) {
      if (!world.bodies[a].molecule || !world.bodies[b].molecule) continue;
      const docking::Molecule& molecule_a = *world.bodies[a].molecule;
      const docking::Molecule& molecule_b = *world.bodies[b].molecule;
      const double radius = 0.5 * (molecule_a.gyration_radius_angstrom() + molecule_b.gyration_radius_angstrom());
      pairs_.push_back({a, b, docking::MolecularField(molecule_a, molecule_b, world.field_model),
                        radius * world.metres_per_angstrom, 0, 0});
    }
  }
}

MolecularForces::~MolecularForces() = default;

bool MolecularForces::add_wrenches(std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept {
  bool is_limited = false;
  energy_kj_per_mol_ = felt_kcal_per_mol_ = 0;
  for (Pair& pair : pairs_) {
    is_limited |= add_pair(pair, X_WB, wrenches_W);
    energy_kj_per_mol_ += pair.energy_kj_per_mol;
    felt_kcal_per_mol_ += pair.felt_kcal_per_mol;
  }
  return is_limited;
}

double MolecularForces::energy_j() const {
  return world_->newtons_per_kcal_per_mol_angstrom * world_->metres_per_angstrom * felt_kcal_per_mol_;
}

bool MolecularForces::add_pair(Pair& pair, std::span<const Pose> X_WB, std::span<Wrench> wrenches_W) noexcept {
  const Pose X_AB = X_WB[pair.a].inverse() * X_WB[pair.b];
  const docking::FieldResult result = pair.field.evaluate({X_AB.p / world_->metres_per_angstrom, X_AB.q});
  // The field is not finite if atoms coincide. The pair then keeps its previous energy and has no force.
  if (!std::isfinite(result.energy_kj_per_mol()) || !is_finite(result.force_on_b) || !is_finite(result.torque_on_b)) {
    return true;
  }
  pair.energy_kj_per_mol = result.energy_kj_per_mol();
  const double energy_kcal_per_mol = pair.energy_kj_per_mol / docking::kKilojoulesPerKilocalorie;
  pair.felt_kcal_per_mol = felt_energy_kcal_per_mol(*world_, energy_kcal_per_mol);
  const double newtons = world_->newtons_per_kcal_per_mol_angstrom / docking::kKilojoulesPerKilocalorie *
                         felt_share(*world_, energy_kcal_per_mol);
  const Vec3 f_b = newtons * result.force_on_b;
  const Vec3 t_b = newtons * world_->metres_per_angstrom * result.torque_on_b;
  const Vec3 t_a = -t_b - X_AB.p.cross(f_b);

  const double twist = (t_a.squaredNorm() + t_b.squaredNorm()) / (2 * pair.gyration_radius_m * pair.gyration_radius_m);
  const double magnitude = std::sqrt(f_b.squaredNorm() + twist);
  const double bounded = soft_limit(magnitude, world_->molecular_force_limit_n);
  const double factor = magnitude > 0 ? bounded / magnitude : 1.0;
  const Quat& q_WA = X_WB[pair.a].q;
  wrenches_W[pair.a] += Wrench{q_WA * (-factor * f_b), q_WA * (factor * t_a)};
  wrenches_W[pair.b] += Wrench{q_WA * (factor * f_b), q_WA * (factor * t_b)};
  return bounded < magnitude;
}

}  // namespace tandem::physics
