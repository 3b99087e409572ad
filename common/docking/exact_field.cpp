#include "common/docking/exact_field.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "common/docking/field_kernel.hpp"

namespace tandem::docking {
namespace {

constexpr double kFarthestAngstrom = 1e9;
constexpr double kUnitTolerance = 1e-3;

/// Central force of one pair of atoms a and b at the positions p_a and p_b. The force on b is push · (p_b − p_a), so
/// `push` is the force divided by the distance r.
struct Central {
  double energy = 0;
  double push = 0;
  double push_slope = 0;  ///< derivative of push with respect to r, divided by r
};

double inverse_power(int alpha, double r) {
  double value = 1;
  for (double square = 1 / r; alpha > 0; alpha /= 2, square *= square) {
    if (alpha % 2 == 1) value *= square;
  }
  return value;
}

/// Energy r^−α of a pair, with its force switch.
struct PowerTerm {
  int alpha = 0;
  ForceSwitch shape;
  double start = 0;
  double cutoff = 0;  ///< distance beyond which the force is zero [Å]; 0: no cut-off

  PowerTerm(int power, double cutoff_angstrom) : alpha(power), cutoff(cutoff_angstrom) {
    if (cutoff == 0) return;
    start = cutoff - kSwitchWidthAngstrom;
    shape = force_switch(alpha, start, cutoff);
  }

  Central at(double r) const {
    if (cutoff > 0 && r >= cutoff) return {};
    const double value = inverse_power(alpha, r);
    const double x = cutoff > 0 ? std::max(r - start, 0.0) : 0.0;
    const double force = alpha * value / r + x * x * (shape.a + shape.b * x);
    const double slope = -alpha * (alpha + 1) * value / (r * r) + x * (2 * shape.a + 3 * shape.b * x);
    Central pair;
    pair.energy = value - x * x * x * (shape.a / 3 + shape.b / 4 * x) - shape.c;
    pair.push = force / r;
    pair.push_slope = (slope - pair.push) / (r * r);
    return pair;
  }
};

Central combined(double k1, const Central& one, double k2, const Central& two) {
  return {k1 * one.energy + k2 * two.energy, k1 * one.push + k2 * two.push, k1 * one.push_slope + k2 * two.push_slope};
}

/// Extrapolates a pair from the core radius to a smaller distance (see exact_field()). `at_core` is the energy and
/// force at the core radius, `core2` the squared core radius, and `r2` the squared distance.
Central inside_core(Central at_core, double core2, double r2) {
  at_core.energy += 0.5 * at_core.push * (core2 - r2);
  at_core.push_slope = 0;
  return at_core;
}

/// Returns the cut-off of the exact sum [Å]. It is 0 (none) for a model with a far grid, because the exact sum includes
/// the part that the grid approximates.
double cutoff_angstrom(const FieldModel& model) {
  return model.has_far_grid ? 0 : model.cutoff_angstrom;
}

class PairField {
 public:
  PairField(const FieldModel& model, bool is_arithmetic)
      : dielectric_(model.dielectric),
        is_arithmetic_(is_arithmetic),
        coulomb_(kCoulombKjAngstromPerMol / model.permittivity),
        repulsion_(12, cutoff_angstrom(model)),
        attraction_(6, cutoff_angstrom(model)),
        charge_(model.dielectric == Dielectric::kDistance ? 2 : 1, cutoff_angstrom(model)) {}

  Central lennard_jones(double r2, double sigma_a, double sigma_b, double epsilon) const {
    if (sigma_a == 0 || sigma_b == 0 || epsilon == 0) return {};
    const double mean = 0.5 * (sigma_a + sigma_b);
    const double sigma2 = is_arithmetic_ ? mean * mean : sigma_a * sigma_b;
    const double core2 = static_cast<double>(kCoreFractionSquared) * sigma2;
    const double r = std::sqrt(std::max(r2, core2));
    const double s6 = sigma2 * sigma2 * sigma2;
    const Central pair = combined(4 * epsilon * s6 * s6, repulsion_.at(r), -4 * epsilon * s6, attraction_.at(r));
    return r2 < core2 ? inside_core(pair, core2, r2) : pair;
  }

  Central coulomb(double r2, double charge2) const {
    if (dielectric_ == Dielectric::kNone || charge2 == 0) return {};
    constexpr double kCore2 = kChargeCoreAngstrom * kChargeCoreAngstrom;
    const Central pair = combined(coulomb_ * charge2, charge_.at(std::sqrt(std::max(r2, kCore2))), 0, {});
    return r2 < kCore2 ? inside_core(pair, kCore2, r2) : pair;
  }

 private:
  Dielectric dielectric_;
  bool is_arithmetic_;
  double coulomb_;
  PowerTerm repulsion_, attraction_, charge_;
};

Eigen::Matrix3d skew(const Vec3& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Adds the gradient of one atom of B, with the stiffness K, the lever arm and the force f of the atom. For a
/// displacement δx and a rotation δθ of B, the atom moves by δp = δx + δθ × arm. This changes its force by δf = K (δx −
/// [arm] δθ), and its torque on B by δτ = arm × δf + (δθ × arm) × f. [arm] is the cross-product matrix of arm.
void add_gradient(Matrix6& gradient, const Eigen::Matrix3d& stiffness, const Vec3& arm, const Vec3& force) {
  const Eigen::Matrix3d lever = skew(arm);
  const Eigen::Matrix3d by_rotation = -stiffness * lever;
  gradient.topLeftCorner<3, 3>() += stiffness;
  gradient.topRightCorner<3, 3>() += by_rotation;
  gradient.bottomLeftCorner<3, 3>() += lever * stiffness;
  gradient.bottomRightCorner<3, 3>() += lever * by_rotation + skew(force) * lever;
}

}  // namespace

bool is_evaluable(const Pose& X_AB) {
  return is_finite(X_AB) && std::abs(X_AB.q.squaredNorm() - 1.0) < kUnitTolerance &&
         X_AB.p.cwiseAbs().maxCoeff() < kFarthestAngstrom;
}

FieldResult exact_field(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom, const FieldModel& model,
                        const ExactDetails& details) {
  validate(a);
  validate(b);
  validate(model);
  if (details.forces_on_a != nullptr) details.forces_on_a->assign(a.size(), Vec3::Zero());
  if (details.forces_on_b != nullptr) details.forces_on_b->assign(b.size(), Vec3::Zero());
  if (details.gradient != nullptr) details.gradient->setZero();
  if (details.energies_of_a != nullptr) details.energies_of_a->assign(a.size(), Eigen::Vector2d::Zero());
  if (details.energies_of_b != nullptr) details.energies_of_b->assign(b.size(), Eigen::Vector2d::Zero());
  FieldResult result;
  if (!is_evaluable(X_AB_angstrom)) return result;
  const PairField field(model, a.mixes_arithmetically || b.mixes_arithmetically);
  constexpr std::size_t kReportPairs = 10'000'000;
  std::size_t unreported = 0;
  for (std::size_t j = 0; j < b.size(); ++j) {
    if (details.progress && (unreported += a.size()) >= kReportPairs) {
      unreported = 0;
      details.progress(static_cast<double>(j) / static_cast<double>(b.size()));
    }
    const Vec3 arm = X_AB_angstrom.q * b.positions_angstrom[j];
    const Vec3 position = X_AB_angstrom.p + arm;
    Vec3 force = Vec3::Zero();
    Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
    Eigen::Vector2d energy = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < a.size(); ++i) {
      const Vec3 offset = position - a.positions_angstrom[i];
      const double r2 = offset.squaredNorm();
      const Central lj = field.lennard_jones(r2, a.sigma_angstrom[i], b.sigma_angstrom[j],
                                             std::sqrt(a.epsilon_kj_per_mol[i] * b.epsilon_kj_per_mol[j]));
      const Central coulomb = field.coulomb(r2, a.charge_e[i] * b.charge_e[j]);
      const Vec3 pair_force = (lj.push + coulomb.push) * offset;
      const Eigen::Vector2d pair_energy(lj.energy, coulomb.energy);
      energy += pair_energy;
      if (details.energies_of_a != nullptr) (*details.energies_of_a)[i] += pair_energy;
      force += pair_force;
      if (details.forces_on_a != nullptr) (*details.forces_on_a)[i] -= pair_force;
      if (details.gradient == nullptr) continue;
      stiffness += (lj.push + coulomb.push) * Eigen::Matrix3d::Identity() +
                   (lj.push_slope + coulomb.push_slope) * offset * offset.transpose();
    }
    if (details.forces_on_b != nullptr) (*details.forces_on_b)[j] = force;
    if (details.energies_of_b != nullptr) (*details.energies_of_b)[j] = energy;
    if (details.gradient != nullptr) add_gradient(*details.gradient, stiffness, arm, force);
    result.lennard_jones_kj_per_mol += energy[0];
    result.coulomb_kj_per_mol += energy[1];
    result.force_on_b += force;
    result.torque_on_b += arm.cross(force);
  }
  if (details.progress) details.progress(1);
  return result;
}

std::vector<Eigen::Vector2d> residue_energies(const Molecule& molecule,
                                              std::span<const Eigen::Vector2d> atom_energies) {
  if (atom_energies.size() != molecule.size()) {
    throw std::invalid_argument("residue energies: " + std::to_string(atom_energies.size()) + " energies of " +
                                std::to_string(molecule.size()) + " atoms");
  }
  const std::vector<std::size_t> starts = residue_starts(molecule);
  std::vector<Eigen::Vector2d> sums(starts.size(), Eigen::Vector2d::Zero());
  for (std::size_t r = 0; r < starts.size(); ++r) {
    const std::size_t end = r + 1 < starts.size() ? starts[r + 1] : molecule.size();
    for (std::size_t i = starts[r]; i < end; ++i) sums[r] += atom_energies[i];
  }
  return sums;
}

}  // namespace tandem::docking
