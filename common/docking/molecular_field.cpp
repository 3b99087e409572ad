// Set-up of the float kernels, and choice of the kernel to call.
//
// The float arrays of A are fixed at construction. A call transforms B's positions in double precision and passes both
// molecules to the kernel that the CPU supports (field_kernel.hpp). The sums over B's atoms are in double precision.
#include "common/docking/molecular_field.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/docking/cluster_tree.hpp"
#include "common/docking/exact_field.hpp"
#include "common/docking/far_grid.hpp"
#include "common/docking/field_kernel.hpp"

namespace tandem::docking {
namespace {

constexpr std::align_val_t kAlignment{64};

bool has_lennard_jones(const Molecule& molecule, std::size_t atom) {
  return molecule.sigma_angstrom[atom] > 0 && molecule.epsilon_kj_per_mol[atom] > 0;
}

struct AlignedDelete {
  void operator()(float* floats) const { ::operator delete[](floats, kAlignment); }
};
using AlignedFloats = std::unique_ptr<float[], AlignedDelete>;

AlignedFloats aligned_floats(std::size_t count) {
  AlignedFloats floats(new (kAlignment) float[count]);
  std::fill_n(floats.get(), count, 0.0F);
  return floats;
}

struct NamedKernel {
  std::string_view name;
  AllPairsKernel all_pairs;
  NearKernel near;
  NearChildren near_children;
  FarPointsKernel far_points;
  GridKernel grid;
  double (*multiply_adds)(std::size_t) noexcept;
  std::size_t lanes;
};

std::vector<NamedKernel> runnable_kernels() {
  std::vector<NamedKernel> kernels;
#ifdef TANDEM_FIELD_X86
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (has_avx2 && __builtin_cpu_supports("avx512f")) {
    kernels.push_back({"avx512", all_pairs_avx512, near_avx512, near_children_avx2, far_points_avx512, grid_avx512,
                       multiply_adds_avx512, 16});
  }
  if (has_avx2) {
    kernels.push_back(
        {"avx2", all_pairs_avx2, near_avx2, near_children_avx2, far_points_avx2, grid_avx2, multiply_adds_avx2, 8});
  }
#endif
  kernels.push_back({"portable", all_pairs_portable, near_portable, near_children_portable, far_points_portable,
                     grid_portable, multiply_adds_portable, 4});
  return kernels;
}

/// Index in runnable_kernels() of the default kernel of the process. Kernels round differently, so server and clients
/// must use the same one if results must not depend on the processor.
std::atomic<std::size_t> default_kernel_index{0};

NamedKernel kernel_named(std::string_view name) {
  if (name.empty()) return runnable_kernels()[default_kernel_index];
  std::string known;
  for (const NamedKernel& kernel : runnable_kernels()) {
    if (kernel.name == name) return kernel;
    known += (known.empty() ? "" : ", ") + std::string(kernel.name);
  }
  throw std::invalid_argument("molecular-field kernel '" + std::string(name) + "': this CPU has " + known);
}

KernelModel kernel_model(const FieldModel& model) {
  KernelModel made;
  made.has_charges = model.dielectric != Dielectric::kNone;
  made.is_distance_dependent = model.dielectric == Dielectric::kDistance;
  made.charge_core_squared = static_cast<float>(kChargeCoreAngstrom * kChargeCoreAngstrom);
  if (model.cutoff_angstrom == 0) return made;
  const double start = model.cutoff_angstrom - kSwitchWidthAngstrom;
  made.start = static_cast<float>(start);
  made.cutoff = static_cast<float>(model.cutoff_angstrom);
  const auto fill = [&](double alpha, float& a, float& b, float& c, float& third_a, float& quarter_b) {
    const ForceSwitch shape = force_switch(alpha, start, model.cutoff_angstrom);
    third_a = static_cast<float>(shape.a / 3);
    quarter_b = static_cast<float>(shape.b / 4);
    a = static_cast<float>(shape.a);
    b = static_cast<float>(shape.b);
    c = static_cast<float>(shape.c);
  };
  fill(12, made.a12, made.b12, made.c12, made.third_a12, made.quarter_b12);
  fill(6, made.a6, made.b6, made.c6, made.third_a6, made.quarter_b6);
  fill(made.is_distance_dependent ? 2 : 1, made.aq, made.bq, made.cq, made.third_aq, made.quarter_bq);
  return made;
}

/// Numbers of operations per pair, counted as in KERNELS.md.
struct PairCost {
  /// Field without a cut-off: operations per pair with a Lennard-Jones term, and per pair with charges only.
  std::size_t with_lennard_jones, charges_alone;
  /// Field with a cut-off: operations per computed pair, per comparison of two atoms, and per comparison with a box.
  std::size_t switched, distance, box;
};

/// Returns the cost in vector instructions; a fused multiply-add counts as one instruction.
PairCost fused_cost(Dielectric dielectric) {
  switch (dielectric) {
    case Dielectric::kNone:
      return {22, 0, 55, 6, 18};
    case Dielectric::kConstant:
      return {28, 19, 63, 6, 18};
    case Dielectric::kDistance:
      return {25, 16, 64, 6, 18};
  }
  return {};
}

/// Returns the cost of the portable kernel, which has no fused multiply-adds. Additions, multiplications, divisions and
/// roots count as one operation each; two operations count as one multiply-add.
PairCost separate_cost(Dielectric dielectric) {
  switch (dielectric) {
    case Dielectric::kNone:
      return {26, 0, 68, 8, 21};
    case Dielectric::kConstant:
      return {32, 22, 82, 8, 21};
    case Dielectric::kDistance:
      return {30, 20, 83, 8, 21};
  }
  return {};
}

/// The atoms with a force: first those with Lennard-Jones parameters, then those with only a charge.
struct Interacting {
  std::vector<std::size_t> atoms;
  std::size_t lj_count = 0;

  Interacting(const Molecule& molecule, const FieldModel& model) {
    for (std::size_t i = 0; i < molecule.size(); ++i) {
      if (has_lennard_jones(molecule, i)) atoms.push_back(i);
    }
    lj_count = atoms.size();
    if (model.dielectric == Dielectric::kNone) return;
    for (std::size_t i = 0; i < molecule.size(); ++i) {
      if (!has_lennard_jones(molecule, i) && molecule.charge_e[i] != 0) atoms.push_back(i);
    }
  }

  std::vector<Vec3> positions(const Molecule& molecule) const {
    std::vector<Vec3> found;
    for (const std::size_t atom : atoms) found.push_back(molecule.positions_angstrom[atom]);
    return found;
  }

  void reorder(const std::vector<std::uint32_t>& order) {
    std::vector<std::size_t> ordered;
    for (const std::uint32_t index : order) ordered.push_back(atoms[index]);
    atoms = std::move(ordered);
  }
};

float c6_of(const Molecule& m, std::size_t i, bool is_arithmetic) {
  if (!has_lennard_jones(m, i)) return 0;
  const double size = is_arithmetic ? 1 : std::pow(m.sigma_angstrom[i], 3);
  return static_cast<float>(2 * std::sqrt(m.epsilon_kj_per_mol[i]) * size);
}

float s3_of(const Molecule& m, std::size_t i, bool is_arithmetic) {
  if (!has_lennard_jones(m, i)) return 0;
  return static_cast<float>(is_arithmetic ? 0.5 * m.sigma_angstrom[i] : std::pow(m.sigma_angstrom[i], 3));
}

float sigma_of(const Molecule& m, std::size_t i) {
  return has_lennard_jones(m, i) ? static_cast<float>(m.sigma_angstrom[i]) : 0.0F;
}

float charge_of(const Molecule& m, std::size_t i, const FieldModel& model) {
  return model.dielectric == Dielectric::kNone ? 0.0F : static_cast<float>(m.charge_e[i]);
}

// Works around a compiler error: when g++ 12 -O3 inlines this function, it combines the three axes of a position and
// uses the low part of a wrong axis.
[[gnu::noinline]] SplitFloat split(double value) {
  const auto high = static_cast<float>(value);
  return {high, static_cast<float>(value - static_cast<double>(high))};
}

double value_of(const SplitFloat& value) {
  return static_cast<double>(value.high) + static_cast<double>(value.low);
}

float largest_sigma(const Molecule& molecule) {
  float largest = 0;
  for (std::size_t i = 0; i < molecule.size(); ++i) largest = std::max(largest, sigma_of(molecule, i));
  return largest;
}

}  // namespace

struct MolecularField::Impl {
  Impl(const Molecule& a, const Molecule& b, const FieldModel& field_model, std::string_view kernel_name);

  void lay_out_a(const Molecule& a, const Interacting& chosen, float largest_sigma_b);
  void add_tiles(const Molecule& a, const std::vector<std::size_t>& atoms, std::size_t begin, std::size_t end,
                 std::size_t tile_atoms, float largest_sigma_b);
  void lay_out_b(const Molecule& b, const Interacting& chosen);
  void place_b(const Pose& X_AB, const Eigen::Matrix3d& R_AB, std::size_t begin, std::size_t end) noexcept;
  void add_neighbours(const Pose& X_AB, FieldSums& sums) noexcept;
  FieldResult evaluate(const Pose& X_AB) noexcept;

  FieldModel model;
  /// True: A and B in this object are the caller's B and A, because the caller's B comes_first().
  bool is_swapped = false;
  KernelModel constants;
  NamedKernel kernel;
  std::optional<ClusterTree> tree_a, tree_b;  ///< trees over the atoms; present only with a cut-off
  std::optional<NeighbourSearch> search;
  std::shared_ptr<const FarGrid> far;
  std::size_t count_a = 0;
  std::size_t lj_count_a = 0;
  FieldSums last;

  AlignedFloats x_a, y_a, z_a, c6_a, s3_a, sigma_a, charge_a;
  std::size_t filled_a = 0;
  std::vector<Tile> tiles;
  std::size_t lj_tiles = 0;

  std::vector<double> x_own, y_own, z_own;  ///< positions of B's atoms in B's frame
  std::size_t count_b = 0, lj_count_b = 0;
  std::vector<float> c6_b, s3_b, sigma_b, charge_b;
  std::vector<float> far_c6_b, far_s3_b;  ///< parameters of B for the far grid, with geometric mixing
  std::vector<double> x_b, y_b, z_b, arm_x, arm_y, arm_z;

  std::size_t all_lj_pairs() const { return lj_count_a * lj_count_b; }
  std::size_t all_charge_pairs() const { return count_a * count_b - all_lj_pairs(); }

  Target target() const {
    return {x_a.get(),     y_a.get(),      z_a.get(),    c6_a.get(), s3_a.get(),
            sigma_a.get(), charge_a.get(), tiles.data(), lj_tiles,   tiles.size()};
  }
  Probes probes() const {
    return {lj_count_b,   count_b,      x_b.data(),  y_b.data(),  z_b.data(),     arm_x.data(),
            arm_y.data(), arm_z.data(), c6_b.data(), s3_b.data(), sigma_b.data(), charge_b.data()};
  }
};

MolecularField::Impl::Impl(const Molecule& a, const Molecule& b, const FieldModel& field_model,
                           std::string_view kernel_name)
    : model(field_model), constants(kernel_model(field_model)), kernel(kernel_named(kernel_name)) {
  constants.is_arithmetic = a.mixes_arithmetically || b.mixes_arithmetically;
  Interacting chosen_a(a, model);
  Interacting chosen_b(b, model);
  if (model.cutoff_angstrom > 0) {
    tree_a.emplace(chosen_a.positions(a));
    tree_b.emplace(chosen_b.positions(b));
    search.emplace(*tree_a, *tree_b, kernel.near_children);
    chosen_a.reorder(tree_a->order());
    chosen_b.reorder(tree_b->order());
  }
  lay_out_a(a, chosen_a, largest_sigma(b));
  lay_out_b(b, chosen_b);
  if (model.has_far_grid) far = make_far_grid(a, b, model, constants, kernel.far_points);
}

void MolecularField::Impl::lay_out_a(const Molecule& a, const Interacting& chosen, float largest_sigma_b) {
  count_a = chosen.atoms.size();
  lj_count_a = chosen.lj_count;
  const std::size_t padded = count_a + 2 * kLanes;
  for (AlignedFloats* floats : {&x_a, &y_a, &z_a, &c6_a, &s3_a, &sigma_a, &charge_a}) *floats = aligned_floats(padded);
  if (model.cutoff_angstrom > 0) {
    add_tiles(a, chosen.atoms, 0, count_a, kLanes, largest_sigma_b);
  } else {
    add_tiles(a, chosen.atoms, 0, chosen.lj_count, kTileAtoms, largest_sigma_b);
    lj_tiles = tiles.size();
    add_tiles(a, chosen.atoms, chosen.lj_count, count_a, kTileAtoms, largest_sigma_b);
  }
}

void MolecularField::Impl::add_tiles(const Molecule& a, const std::vector<std::size_t>& atoms, std::size_t begin,
                                     std::size_t end, std::size_t tile_atoms, float largest_sigma_b) {
  for (; begin < end; begin += tile_atoms) {
    const std::size_t count = std::min(tile_atoms, end - begin);
    Tile tile;
    tile.begin = filled_a;
    tile.end = filled_a + (count + kLanes - 1) / kLanes * kLanes;
    Vec3 lower = a.positions_angstrom[atoms[begin]], upper = lower;
    for (std::size_t i = 0; i < count; ++i) {
      lower = lower.cwiseMin(a.positions_angstrom[atoms[begin + i]]);
      upper = upper.cwiseMax(a.positions_angstrom[atoms[begin + i]]);
    }
    Vec3 origin = 0.5 * (lower + upper);
    for (int axis = 0; axis < 3; ++axis) {
      tile.origin[axis] = split(origin[axis]);
      origin[axis] = value_of(tile.origin[axis]);
    }
    double radius = 0;
    float sigma = 0;
    for (std::size_t i = tile.begin; i < tile.end; ++i) {
      const bool is_padding = i - tile.begin >= count;
      const std::size_t atom = atoms[begin + std::min(i - tile.begin, count - 1)];
      const Vec3 local = a.positions_angstrom[atom] - origin;
      x_a[i] = static_cast<float>(local.x());
      y_a[i] = static_cast<float>(local.y());
      z_a[i] = static_cast<float>(local.z());
      s3_a[i] = s3_of(a, atom, constants.is_arithmetic);
      sigma_a[i] = sigma_of(a, atom);
      c6_a[i] = is_padding ? 0.0F : c6_of(a, atom, constants.is_arithmetic);
      charge_a[i] = is_padding ? 0.0F : charge_of(a, atom, model);
      radius = std::max(radius, local.norm());
      sigma = std::max(sigma, sigma_a[i]);
    }
    for (int axis = 0; axis < 3; ++axis) {
      tile.half[axis] = 1.000001F * static_cast<float>(upper[axis] - origin[axis]) + 1e-5F;
    }
    constexpr float kMargin = 1.01F;
    const float mean_sigma = 0.5F * (sigma + largest_sigma_b);
    tile.core2 =
        kMargin * kCoreFractionSquared * (constants.is_arithmetic ? mean_sigma * mean_sigma : sigma * largest_sigma_b);
    if (constants.has_charges) tile.core2 = std::max(tile.core2, kMargin * constants.charge_core_squared);
    const double reach = kMargin * radius + std::sqrt(tile.core2);
    tile.reach2 = static_cast<float>(reach * reach);
    filled_a = tile.end;
    tiles.push_back(tile);
  }
}

void MolecularField::Impl::lay_out_b(const Molecule& b, const Interacting& chosen) {
  const double coulomb = kCoulombKjAngstromPerMol / model.permittivity;
  count_b = chosen.atoms.size();
  lj_count_b = chosen.lj_count;
  for (const std::size_t j : chosen.atoms) {
    x_own.push_back(b.positions_angstrom[j].x());
    y_own.push_back(b.positions_angstrom[j].y());
    z_own.push_back(b.positions_angstrom[j].z());
    c6_b.push_back(c6_of(b, j, constants.is_arithmetic));
    s3_b.push_back(s3_of(b, j, constants.is_arithmetic));
    far_c6_b.push_back(c6_of(b, j, false));
    far_s3_b.push_back(s3_of(b, j, false));
    sigma_b.push_back(sigma_of(b, j));
    charge_b.push_back(static_cast<float>(coulomb * static_cast<double>(charge_of(b, j, model))));
  }
  const std::size_t padded = (count_b + kLanes - 1) / kLanes * kLanes;
  for (std::vector<float>* values : {&c6_b, &s3_b, &sigma_b, &charge_b, &far_c6_b, &far_s3_b}) values->resize(padded);
  for (std::vector<double>* values : {&arm_x, &arm_y, &arm_z}) values->resize(padded);
  for (std::vector<double>* values : {&x_b, &y_b, &z_b}) values->resize(padded, kFarAwayAngstrom);
}

void MolecularField::Impl::place_b(const Pose& X_AB, const Eigen::Matrix3d& R_AB, std::size_t begin,
                                   std::size_t end) noexcept {
  const double *const x = x_own.data(), *const y = y_own.data(), *const z = z_own.data();
  double* const arms[3] = {arm_x.data(), arm_y.data(), arm_z.data()};
  double* const places[3] = {x_b.data(), y_b.data(), z_b.data()};
  for (int axis = 0; axis < 3; ++axis) {
    const double a = R_AB(axis, 0), b = R_AB(axis, 1), c = R_AB(axis, 2), p = X_AB.p[axis];
    double* __restrict const arm = arms[axis], * __restrict const place = places[axis];
    for (std::size_t j = begin; j < end; ++j) {
      arm[j] = a * x[j] + b * y[j] + c * z[j];
      place[j] = p + arm[j];
    }
  }
}

void MolecularField::Impl::add_neighbours(const Pose& X_AB, FieldSums& sums) noexcept {
  const Eigen::Matrix3d R_AB = X_AB.q.toRotationMatrix();
  const Target a = target();
  const Probes b = probes();
  search->run(X_AB, model.cutoff_angstrom, [&](std::uint32_t leaf, std::span<const std::uint32_t> near) {
    const std::size_t begin = leaf * kLanes;
    const std::size_t end = std::min(begin + kLanes, count_b);
    place_b(X_AB, R_AB, begin, end);
    kernel.near(a, b, constants, {begin, end, near.data(), near.size()}, sums);
  });
}

MolecularField::MolecularField(const Molecule& a, const Molecule& b, const FieldModel& model, std::string_view kernel) {
  validate(a);
  validate(b);
  validate(model);
  const bool is_swapped = comes_first(b, a);
  impl_ = std::make_unique<Impl>(is_swapped ? b : a, is_swapped ? a : b, model, kernel);
  impl_->is_swapped = is_swapped;
}

void MolecularField::use_by_default(std::string_view kernel) {
  const auto kernels = runnable_kernels();
  const std::string_view wanted = kernel.empty() ? kernels.front().name : kernel_named(kernel).name;
  std::size_t index = 0;
  while (kernels[index].name != wanted) ++index;
  default_kernel_index = index;
}

std::string_view MolecularField::default_kernel() {
  return kernel_named("").name;
}

MolecularField::~MolecularField() = default;
MolecularField::MolecularField(MolecularField&&) noexcept = default;
MolecularField& MolecularField::operator=(MolecularField&&) noexcept = default;

FieldResult MolecularField::evaluate(const Pose& X_AB_angstrom) noexcept {
  if (!is_evaluable(X_AB_angstrom)) return {};
  Impl& f = *impl_;
  if (!f.is_swapped) return f.evaluate(X_AB_angstrom);
  const Pose X_BA = X_AB_angstrom.inverse();
  const FieldResult of_a = f.evaluate(X_BA);  // force on the caller's A, in B's frame
  FieldResult result = of_a;
  result.force_on_b = -(X_AB_angstrom.q * of_a.force_on_b);
  result.torque_on_b = -(X_AB_angstrom.q * (of_a.torque_on_b + X_BA.p.cross(of_a.force_on_b)));
  return result;
}

FieldResult MolecularField::Impl::evaluate(const Pose& X_AB) noexcept {
  FieldSums sums;
  const Eigen::Matrix3d R_AB = X_AB.q.toRotationMatrix();
  if (search) {
    add_neighbours(X_AB, sums);
    if (far) {
      place_b(X_AB, R_AB, 0, count_b);
      kernel.grid(nodes_of(*far), probes(), far_c6_b.data(), far_s3_b.data(), sums);
    }
  } else {
    place_b(X_AB, R_AB, 0, count_b);
    kernel.all_pairs(target(), probes(), constants, sums);
  }
  last = sums;
  FieldResult result;
  result.lennard_jones_kj_per_mol = sums.lennard_jones;
  result.coulomb_kj_per_mol = sums.coulomb;
  result.force_on_b = Vec3(sums.force[0], sums.force[1], sums.force[2]);
  result.torque_on_b = Vec3(sums.torque[0], sums.torque[1], sums.torque[2]);
  return result;
}

std::string_view MolecularField::kernel() const {
  return impl_->kernel.name;
}

std::string_view MolecularField::method() const {
  if (impl_->far) return "clusters and grid";
  return impl_->search ? "clusters" : "all-pairs";
}

const FarGrid* MolecularField::far_grid() const {
  return impl_->far.get();
}

std::size_t MolecularField::pair_count() const {
  return impl_->search ? impl_->last.pairs : impl_->all_lj_pairs() + impl_->all_charge_pairs();
}

std::size_t MolecularField::multiply_adds() const {
  const Impl& f = *impl_;
  const bool is_fused = f.kernel.multiply_adds != multiply_adds_portable;
  PairCost cost = is_fused ? fused_cost(f.model.dielectric) : separate_cost(f.model.dielectric);
  if (f.constants.is_arithmetic) {
    cost.with_lennard_jones += 1;
    cost.switched += 4;
  }
  const std::size_t done =
      f.search ? cost.box * f.last.boxes + cost.distance * f.last.distances + cost.switched * f.last.pairs
               : cost.with_lennard_jones * f.all_lj_pairs() + cost.charges_alone * f.all_charge_pairs();
  return (is_fused ? done : done / 2) + kGridMultiplyAdds * f.last.on_grid;
}

std::vector<std::string_view> MolecularField::available_kernels() {
  std::vector<std::string_view> names;
  for (const NamedKernel& kernel : runnable_kernels()) names.push_back(kernel.name);
  return names;
}

std::size_t MolecularField::run_multiply_adds(std::string_view kernel, std::size_t loops) {
  const NamedKernel chosen = kernel_named(kernel);
  [[maybe_unused]] const volatile double kept = chosen.multiply_adds(loops);
  return 12 * loops * chosen.lanes;
}

bool comes_first(const Molecule& a, const Molecule& b) {
  if (a.size() != b.size()) return a.size() > b.size();
  for (const auto values : {&Molecule::charge_e, &Molecule::sigma_angstrom, &Molecule::epsilon_kj_per_mol}) {
    if (a.*values != b.*values) return a.*values > b.*values;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vec3 &p_a = a.positions_angstrom[i], &p_b = b.positions_angstrom[i];
    if (p_a != p_b) return std::ranges::lexicographical_compare(p_b, p_a);
  }
  return false;
}

void choose_cutoff(const Molecule& a, const Molecule& b, FieldModel& model) {
  const bool is_b_first = comes_first(b, a);
  const Molecule &first = is_b_first ? b : a, &second = is_b_first ? a : b;
  const bool is_cut = a.size() * b.size() > kMaxAllPairs;
  model.cutoff_angstrom = is_cut ? kUsualCutoffAngstrom : 0;
  model.has_far_grid = is_cut && second.size() <= kMaxOnGrid && far_grid_spacing_angstrom(first);
}

}  // namespace tandem::docking
