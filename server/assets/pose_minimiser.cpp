#include "server/assets/pose_minimiser.hpp"

#include <algorithm>
#include <optional>

namespace tandem::server {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kLongest_angstrom = 0.5, kGain_kj_per_mol = 1e-6 * docking::kKilojoulesPerKilocalorie;
constexpr double kShortest_angstrom = 1e-7;
constexpr double kMinDamping = 1e-6, kMaxDamping = 1e12;

double farthest_atom_angstrom(const docking::Molecule& molecule) {
  double extent = 0;
  for (const Vec3& position : molecule.positions_angstrom) extent = std::max(extent, position.norm());
  return extent;
}

}  // namespace

PoseMinimiser::PoseMinimiser(const docking::Molecule& a, const docking::Molecule& b, const docking::FieldModel& model,
                             const Pose& X_AB_angstrom)
    : a_(&a), b_(&b), model_(&model), radius_(std::max(1.0, farthest_atom_angstrom(b))), X_(X_AB_angstrom) {}

/// Returns the pose of the next step; nothing if there is no further step.
std::optional<Pose> PoseMinimiser::next() {
  // The components of rotation are multiplied by the distance of the farthest atom. They then have the unit of length,
  // like those of translation.
  Vector6 push, scale;
  push << here_.force_on_b, here_.torque_on_b;
  scale << 1, 1, 1, radius_, radius_, radius_;
  while (steps_ < kMaxSteps && damping_ < kMaxDamping) {
    ++steps_;
    docking::Matrix6 stiffness = -0.5 * (gradient_ + gradient_.transpose());
    stiffness.diagonal() += damping_ * scale.cwiseAbs2();
    Vector6 step = stiffness.ldlt().solve(push);
    if (!step.allFinite() || step.dot(push) <= 0) {
      damping_ *= 4;
      continue;
    }
    way_ = step.cwiseProduct(scale).norm();
    if (way_ > kLongest_angstrom) step *= kLongest_angstrom / way_;
    return Pose{X_.p + step.head<3>(), (quaternion_of(step.tail<3>()) * X_.q).normalized()};
  }
  return std::nullopt;
}

bool PoseMinimiser::step() {
  if (is_over_) return false;
  if (!is_begun_) {
    here_ = docking::exact_field(*a_, *b_, X_, *model_, {nullptr, nullptr, &gradient_});
    is_begun_ = true;
    return true;
  }
  const std::optional<Pose> wanted = next();
  is_over_ = !wanted;
  if (is_over_) return false;
  docking::Matrix6 next_gradient;
  const docking::FieldResult next_field =
      docking::exact_field(*a_, *b_, *wanted, *model_, {nullptr, nullptr, &next_gradient});
  const double gain = here_.energy_kj_per_mol() - next_field.energy_kj_per_mol();
  if (!(gain > 0)) {
    damping_ *= 4;
    is_over_ = way_ < kShortest_angstrom;
    return !is_over_;
  }
  X_ = *wanted;
  here_ = next_field;
  gradient_ = next_gradient;
  damping_ = std::max(kMinDamping, damping_ / 3);
  is_over_ = gain < kGain_kj_per_mol;
  return !is_over_;
}

}  // namespace tandem::server
