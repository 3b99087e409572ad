// All-pairs Lennard-Jones: the double reference, and the set-up and dispatch of the float kernels.
//
// The float arrays of A are fixed at construction; a call transforms B's few positions in double and hands both to
// the kernel that the CPU runs (lj_kernel.hpp). Sums of energy, force and torque over B's atoms are in double.
#include "common/docking/lennard_jones.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <new>
#include <stdexcept>
#include <string>

#include "common/docking/lj_kernel.hpp"

namespace tandem::docking {
namespace {

constexpr double kFarthestAngstrom = 1e9;
constexpr double kUnitTolerance = 1e-3;
constexpr std::align_val_t kAlignment{64};

bool can_interact(const Pose& X_AB) {
  return is_finite(X_AB) && std::abs(X_AB.q.squaredNorm() - 1.0) < kUnitTolerance &&
         X_AB.p.cwiseAbs().maxCoeff() < kFarthestAngstrom;
}

bool has_lennard_jones(const Molecule& molecule, std::size_t atom) {
  return molecule.sigma_angstrom[atom] > 0 && molecule.epsilon_kj_per_mol[atom] > 0;
}

std::vector<std::size_t> atoms_with_lennard_jones(const Molecule& molecule) {
  std::vector<std::size_t> atoms;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    if (has_lennard_jones(molecule, i)) atoms.push_back(i);
  }
  return atoms;
}

struct PairTerm {
  double energy;
  double force_over_distance;  ///< force on b = this · (p_b − p_a)
};

PairTerm pair_term(double r2, double sigma2, double epsilon) {
  const double bounded = std::max(r2, static_cast<double>(kCoreFractionSquared) * sigma2);
  const double u = sigma2 / bounded;
  const double p = u * u * u;
  const double slope = 24.0 * epsilon * p * (2.0 * p - 1.0) / bounded;
  return {4.0 * epsilon * p * (p - 1.0) + 0.5 * slope * (bounded - r2), slope};
}

struct AlignedDelete {
  void operator()(float* floats) const { ::operator delete[](floats, kAlignment); }
};
using AlignedFloats = std::unique_ptr<float[], AlignedDelete>;

AlignedFloats aligned_floats(std::size_t count, float fill) {
  AlignedFloats floats(new (kAlignment) float[count]);
  std::fill_n(floats.get(), count, fill);
  return floats;
}

struct NamedKernel {
  std::string_view name;
  Kernel function;
};

std::vector<NamedKernel> runnable_kernels() {
  std::vector<NamedKernel> kernels;
#ifdef TANDEM_LJ_X86
  if (__builtin_cpu_supports("avx512f")) kernels.push_back({"avx512", evaluate_avx512});
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    kernels.push_back({"avx2", evaluate_avx2});
  }
#endif
  kernels.push_back({"portable", evaluate_portable});
  return kernels;
}

/// Index into runnable_kernels(): process-wide, because results that must not depend on the CPU need the same kernel at
/// both ends of a session, wherever a field is made.
std::atomic<std::size_t> default_kernel_index{0};

NamedKernel kernel_named(std::string_view name) {
  if (name.empty()) return runnable_kernels()[default_kernel_index];
  std::string known;
  for (const NamedKernel& kernel : runnable_kernels()) {
    if (kernel.name == name) return kernel;
    known += (known.empty() ? "" : ", ") + std::string(kernel.name);
  }
  throw std::invalid_argument("Lennard-Jones kernel '" + std::string(name) + "': this CPU has " + known);
}

}  // namespace

FieldResult lennard_jones_exact(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom,
                                std::vector<Vec3>* forces_on_a, std::vector<Vec3>* forces_on_b) {
  validate(a);
  validate(b);
  if (forces_on_a != nullptr) forces_on_a->assign(a.size(), Vec3::Zero());
  if (forces_on_b != nullptr) forces_on_b->assign(b.size(), Vec3::Zero());
  FieldResult result;
  if (!can_interact(X_AB_angstrom)) return result;
  const std::vector<std::size_t> atoms_of_a = atoms_with_lennard_jones(a);
  for (const std::size_t j : atoms_with_lennard_jones(b)) {
    const Vec3 arm = X_AB_angstrom.q * b.positions_angstrom[j];
    const Vec3 position = X_AB_angstrom.p + arm;
    Vec3 force = Vec3::Zero();
    for (const std::size_t i : atoms_of_a) {
      const Vec3 offset = position - a.positions_angstrom[i];
      const PairTerm term = pair_term(offset.squaredNorm(), a.sigma_angstrom[i] * b.sigma_angstrom[j],
                                      std::sqrt(a.epsilon_kj_per_mol[i] * b.epsilon_kj_per_mol[j]));
      const Vec3 pair_force = term.force_over_distance * offset;
      result.energy_kj_per_mol += term.energy;
      force += pair_force;
      if (forces_on_a != nullptr) (*forces_on_a)[i] -= pair_force;
    }
    if (forces_on_b != nullptr) (*forces_on_b)[j] = force;
    result.force_on_b += force;
    result.torque_on_b += arm.cross(force);
  }
  return result;
}

struct LennardJonesField::Impl {
  NamedKernel kernel;
  std::size_t count_a = 0;
  std::size_t padded_a = 0;
  AlignedFloats x_a, y_a, z_a, inverse_sigma_a, sqrt_epsilon_a;
  std::vector<double> tile_origins;

  std::vector<Vec3> positions_b;  ///< in B's frame
  std::vector<double> sqrt_epsilon_b;
  std::vector<float> sigma_b;
  std::vector<Vec3> arms;  ///< B's frame origin to the atom, in A's frame
  std::vector<double> x_b, y_b, z_b, energy, fx, fy, fz;

  void lay_out_a(const Molecule& a);
  void lay_out_b(const Molecule& b);
  void place_b(const Pose& X_AB);
};

void LennardJonesField::Impl::lay_out_a(const Molecule& a) {
  const std::vector<std::size_t> atoms = atoms_with_lennard_jones(a);
  count_a = atoms.size();
  padded_a = (count_a + kLanes - 1) / kLanes * kLanes;
  for (AlignedFloats* floats : {&x_a, &y_a, &z_a, &sqrt_epsilon_a}) *floats = aligned_floats(padded_a, 0.0F);
  inverse_sigma_a = aligned_floats(padded_a, 1.0F);
  for (std::size_t begin = 0; begin < count_a; begin += kTileAtoms) {
    const std::size_t end = std::min(begin + kTileAtoms, count_a);
    Vec3 origin = Vec3::Zero();
    for (std::size_t i = begin; i < end; ++i) origin += a.positions_angstrom[atoms[i]];
    origin /= static_cast<double>(end - begin);
    tile_origins.insert(tile_origins.end(), {origin.x(), origin.y(), origin.z()});
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 local = a.positions_angstrom[atoms[i]] - origin;
      x_a[i] = static_cast<float>(local.x());
      y_a[i] = static_cast<float>(local.y());
      z_a[i] = static_cast<float>(local.z());
      inverse_sigma_a[i] = static_cast<float>(1.0 / a.sigma_angstrom[atoms[i]]);
      sqrt_epsilon_a[i] = static_cast<float>(std::sqrt(a.epsilon_kj_per_mol[atoms[i]]));
    }
  }
}

void LennardJonesField::Impl::lay_out_b(const Molecule& b) {
  for (const std::size_t j : atoms_with_lennard_jones(b)) {
    positions_b.push_back(b.positions_angstrom[j]);
    sigma_b.push_back(static_cast<float>(b.sigma_angstrom[j]));
    sqrt_epsilon_b.push_back(std::sqrt(b.epsilon_kj_per_mol[j]));
  }
  arms.resize(positions_b.size());
  for (std::vector<double>* values : {&x_b, &y_b, &z_b, &energy, &fx, &fy, &fz}) values->resize(positions_b.size());
}

void LennardJonesField::Impl::place_b(const Pose& X_AB) {
  const Eigen::Matrix3d R_AB = X_AB.q.toRotationMatrix();
  for (std::size_t j = 0; j < positions_b.size(); ++j) {
    arms[j] = R_AB * positions_b[j];
    x_b[j] = X_AB.p.x() + arms[j].x();
    y_b[j] = X_AB.p.y() + arms[j].y();
    z_b[j] = X_AB.p.z() + arms[j].z();
  }
}

LennardJonesField::LennardJonesField(const Molecule& a, const Molecule& b, std::string_view kernel)
    : impl_(std::make_unique<Impl>()) {
  validate(a);
  validate(b);
  impl_->kernel = kernel_named(kernel);
  impl_->lay_out_a(a);
  impl_->lay_out_b(b);
}

void LennardJonesField::use_by_default(std::string_view kernel) {
  const auto kernels = runnable_kernels();
  const std::string_view wanted = kernel.empty() ? kernels.front().name : kernel_named(kernel).name;
  std::size_t index = 0;
  while (kernels[index].name != wanted) ++index;
  default_kernel_index = index;
}

std::string_view LennardJonesField::default_kernel() {
  return kernel_named("").name;
}

LennardJonesField::~LennardJonesField() = default;
LennardJonesField::LennardJonesField(LennardJonesField&&) noexcept = default;
LennardJonesField& LennardJonesField::operator=(LennardJonesField&&) noexcept = default;

FieldResult LennardJonesField::evaluate(const Pose& X_AB_angstrom) noexcept {
  FieldResult result;
  if (!can_interact(X_AB_angstrom)) return result;
  Impl& f = *impl_;
  f.place_b(X_AB_angstrom);
  const Target target = {
      f.padded_a,           f.x_a.get(), f.y_a.get(), f.z_a.get(), f.inverse_sigma_a.get(), f.sqrt_epsilon_a.get(),
      f.tile_origins.data()};
  const Probes probes = {f.positions_b.size(), f.x_b.data(), f.y_b.data(), f.z_b.data(), f.sigma_b.data(),
                         f.energy.data(),      f.fx.data(),  f.fy.data(),  f.fz.data()};
  f.kernel.function(target, probes);
  for (std::size_t j = 0; j < f.positions_b.size(); ++j) {
    const Vec3 force = 24.0 * f.sqrt_epsilon_b[j] * Vec3(f.fx[j], f.fy[j], f.fz[j]);
    result.energy_kj_per_mol += 4.0 * f.sqrt_epsilon_b[j] * f.energy[j];
    result.force_on_b += force;
    result.torque_on_b += f.arms[j].cross(force);
  }
  return result;
}

std::string_view LennardJonesField::kernel() const {
  return impl_->kernel.name;
}

std::size_t LennardJonesField::pair_count() const {
  return impl_->count_a * impl_->positions_b.size();
}

std::vector<std::string_view> LennardJonesField::available_kernels() {
  std::vector<std::string_view> names;
  for (const NamedKernel& kernel : runnable_kernels()) names.push_back(kernel.name);
  return names;
}

}  // namespace tandem::docking
