// The field of two rigid molecules, fast enough for the haptic loop.
#pragma once

#include <cstddef>
#include <memory>
#include <string_view>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::docking {

class FarGrid;

/// Defines an order of two molecules that does not depend on the order of the arguments. Returns true if `a` is first:
/// it has more atoms, or, with equal numbers of atoms, the greater value at the first difference. Charges, σ, ε and
/// positions are compared in this order.
bool comes_first(const Molecule& a, const Molecule& b);

/// Evaluates the field at 1 kHz. The model is that of exact_field(), including cores and cut-off. For speed, pair terms
/// are computed in float and summed in double, and the arrays are arranged and padded only once. Each kernel has one
/// fixed order of summation.
///
/// Without a cut-off all pairs are evaluated. With a cut-off only the pairs of close clusters of 16 atoms are
/// evaluated. The result depends only on the present pose.
/// Except for rounding errors of the pose, the result does not depend on which molecule is passed as A. The molecule
/// selected by comes_first() is divided into tiles, or is surrounded by the grid. The kernels iterate over the atoms of
/// the other molecule.
///
/// Cost    pair_count() pairs, no allocation in evaluate(); for measured rates see KERNELS.md
/// Thread  any; each object by one thread at a time
class MolecularField {
 public:
  /// In      kernel  one of available_kernels(), or "" for default_kernel()
  /// Fails   std::invalid_argument: unknown kernel, or an invalid molecule or model, see validate()
  MolecularField(const Molecule& a, const Molecule& b, const FieldModel& model = {}, std::string_view kernel = "");
  ~MolecularField();
  MolecularField(MolecularField&&) noexcept;
  MolecularField& operator=(MolecularField&&) noexcept;

  FieldResult evaluate(const Pose& X_AB_angstrom) noexcept;
  std::string_view kernel() const;
  /// Returns the method of summation: "all-pairs", "clusters", or "clusters and grid".
  std::string_view method() const;
  /// Returns the far grid (far_grid.hpp); null without FieldModel::has_far_grid, or if the first molecule is too large
  /// for a grid.
  const FarGrid* far_grid() const;
  /// Returns the number of pairs of atoms that evaluate() computes. Atoms without any term are not counted. With a
  /// cut-off, it is the number in the last call. It then includes all pairs of a vector register if at least one of
  /// them is within the cut-off.
  std::size_t pair_count() const;
  /// Returns the number of multiply-adds of the last evaluate(), counted as in KERNELS.md. Coordinate transformation
  /// and the sums over atoms are excluded.
  std::size_t multiply_adds() const;

  /// Names of the kernels that this CPU can run, widest first; "portable" is always the last.
  static std::vector<std::string_view> available_kernels();
  /// Selects the default kernel of the process. It is used by each field that is created later with the kernel name "".
  /// `kernel` is a name in available_kernels(), or "" for the kernel with the widest registers. Throws
  /// std::invalid_argument for any other name.
  /// Thread  any
  static void use_by_default(std::string_view kernel);
  /// Returns the name of the default kernel.
  static std::string_view default_kernel();
  /// Executes multiply-adds in registers only, with the instructions of this kernel, to measure the peak rate. Returns
  /// their number: 12 · loops · lanes.
  static std::size_t run_multiply_adds(std::string_view kernel, std::size_t loops);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

inline constexpr double kUsualCutoffAngstrom = 8;
/// Maximum number of pairs for the sum over all pairs. This number takes about a third of a millisecond on one AVX-512
/// core, and both server and clients evaluate the field in every tick.
inline constexpr std::size_t kMaxAllPairs = 1'000'000;
/// Maximum number of atoms of the smaller molecule for a far grid; a grid look-up takes about 30 ns per atom and tick.
inline constexpr std::size_t kMaxOnGrid = 12'000;
/// Sets the default method of summation. Up to kMaxAllPairs, all pairs are summed. If there are more, only pairs within
/// kUsualCutoffAngstrom are summed, and a grid around the molecule that comes_first() selects adds the part beyond. The
/// grid is used only if that molecule is small enough (far_grid_spacing_angstrom()) and the other one has at most
/// kMaxOnGrid atoms.
void choose_cutoff(const Molecule& a, const Molecule& b, FieldModel& model);

}  // namespace tandem::docking
