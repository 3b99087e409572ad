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

/// Order of two molecules that does not depend on their roles; the first one gets the tiles or the grid. `a` is first
/// if it has more atoms, or at equal number the greater value at the first difference (charges, σ, ε, positions).
bool comes_first(const Molecule& a, const Molecule& b);

/// The 1 kHz path: pair terms in float, sums in double, arrays laid out and padded once, one fixed order of summation
/// per kernel. The same model as exact_field(), cores and cut-off included.
///
/// Without a cut-off all pairs are evaluated; with one, the pairs of neighbouring clusters of 16 atoms. The result
/// depends only on the pose, never on earlier ones.
///
/// Except for rounding of the pose, the result does not depend on which molecule is called A. The molecule that
/// comes_first() has the tiles or the grid; the other one's atoms are evaluated against them.
///
/// Cost    pair_count() pairs, no allocation in evaluate(); KERNELS.md has measured rates
/// Thread  any, one at a time per object
class MolecularField {
 public:
  /// `kernel`: "" selects the default_kernel(), else a name of available_kernels(). Throws std::invalid_argument for
  /// another name, or see the two validate().
  MolecularField(const Molecule& a, const Molecule& b, const FieldModel& model = {}, std::string_view kernel = "");
  ~MolecularField();
  MolecularField(MolecularField&&) noexcept;
  MolecularField& operator=(MolecularField&&) noexcept;

  FieldResult evaluate(const Pose& X_AB_angstrom) noexcept;
  std::string_view kernel() const;
  /// "all-pairs", "clusters", or "clusters and grid".
  std::string_view method() const;
  /// See far_grid.hpp; null without FieldModel::has_far_grid, or if the first molecule is too large for a grid.
  const FarGrid* far_grid() const;
  /// Number of pairs of atoms that evaluate() computes; with a cut-off, of the last call: whole registers with a pair
  /// within it. Excludes atoms without a term.
  std::size_t pair_count() const;
  /// Multiply-adds of the last evaluate(), counted as in KERNELS.md; excludes set-up and sums by atom.
  std::size_t multiply_adds() const;

  /// Names of the kernels this CPU can run, widest first; "portable" is always the last.
  static std::vector<std::string_view> available_kernels();
  /// Selects the kernel for "" in the whole process; "" selects the widest again. Call it before fields are made.
  /// Throws std::invalid_argument for a name that is not one of available_kernels().
  /// Thread  any
  static void use_by_default(std::string_view kernel);
  /// Name of the kernel that "" selects.
  static std::string_view default_kernel();
  /// Runs multiply-adds in registers only, with the instructions of this kernel. Returns their number: 12 · loops ·
  /// lanes.
  static std::size_t run_multiply_adds(std::string_view kernel, std::size_t loops);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

inline constexpr double kUsualCutoffAngstrom = 8;
/// About a third of a millisecond on one AVX-512 core; server and clients each compute the pairs in every tick.
inline constexpr std::size_t kMaxAllPairs = 1'000'000;
/// Maximum atoms of the smaller molecule for look-ups in a grid: each takes about 30 ns of every tick.
inline constexpr std::size_t kMaxOnGrid = 12'000;
/// Sets the default summation. Up to a million pairs: all of them. Above: pairs within 8 Å, and the part beyond from a
/// grid around the molecule that comes_first(). The grid is used if that molecule is small enough
/// (far_grid_spacing_angstrom()) and the other has at most kMaxOnGrid atoms.
void choose_cutoff(const Molecule& a, const Molecule& b, FieldModel& model);

}  // namespace tandem::docking
