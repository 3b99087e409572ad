// The field of two rigid molecules for the haptic loop.
#pragma once

#include <cstddef>
#include <memory>
#include <string_view>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::docking {

class FarGrid;

/// Whether the field of both is laid out about `a`: it has more atoms, or as many and its numbers are greater where they first
/// differ (charges, σ, ε, positions). An order of the molecules, whatever their roles.
bool comes_first(const Molecule& a, const Molecule& b);

/// The 1 kHz path: pair terms in float, sums in double, arrays laid out and padded once, one fixed order
/// of summation per kernel. The same model as exact_field(), cores and cut-off included.
///
/// Without a cut-off all pairs are evaluated; with one those of neighbouring clusters of 16 atoms. The result depends
/// on the pose alone, never on earlier ones.
///
/// Nor does it depend on which of the two is called A, but for rounding of the pose: the molecule that comes_first() has the
/// tiles, or the grid, and the other one's atoms are held against them.
///
/// Cost    pair_count() pairs, no allocation in evaluate(); README.md has measured rates
/// Thread  any, one at a time per object
class MolecularField {
 public:
  /// `kernel`: "" picks the widest that the CPU has; or a name of available_kernels().
  /// Throws std::invalid_argument for another name, or see the two validate().
  MolecularField(const Molecule& a, const Molecule& b, const FieldModel& model = {}, std::string_view kernel = "");
  ~MolecularField();
  MolecularField(MolecularField&&) noexcept;
  MolecularField& operator=(MolecularField&&) noexcept;

  FieldResult evaluate(const Pose& X_AB_angstrom) noexcept;
  std::string_view kernel() const;
  /// "all-pairs", "clusters", or "clusters and grid".
  std::string_view method() const;
  /// See far_grid.hpp; none without FieldModel::has_far_grid, or where the first molecule is too large for one.
  const FarGrid* far_grid() const;
  /// Pairs of atoms that evaluate() computes; with a cut-off, that the last call did: whole registers with a pair within
  /// it. Atoms without a term are left out.
  std::size_t pair_count() const;
  /// Multiply-adds that the last evaluate() needed, as README.md counts them; set-up and sums by atom left out.
  std::size_t multiply_adds() const;

  /// Names of the kernels this CPU can run, widest first; "portable" is always the last.
  static std::vector<std::string_view> available_kernels();
  /// From now on "" picks this kernel in the whole process; "": the widest again. Before fields are made.
  /// Throws std::invalid_argument for a name that is not one of available_kernels().
  /// Thread  any
  static void use_by_default(std::string_view kernel);
  /// What "" picks.
  static std::string_view default_kernel();
  /// Runs multiply-adds of registers only, with the instructions of this kernel. How many it ran: 12 · loops · lanes.
  static std::size_t run_multiply_adds(std::string_view kernel, std::size_t loops);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

inline constexpr double kUsualCutoffAngstrom = 8;
/// A third of a millisecond of one AVX-512 core: server and clients each compute them in every tick.
inline constexpr std::size_t kMaxAllPairs = 1'000'000;
/// Atoms of the smaller molecule that are looked up in a grid: each takes some 30 ns of every tick.
inline constexpr std::size_t kMaxOnGrid = 12'000;
/// What is summed where nobody says: all pairs up to a million of them; above that those within 8 Å, and what is beyond from
/// a grid about the molecule that comes_first() where that is small enough for one (far_grid_spacing_angstrom()) and the
/// other has at most kMaxOnGrid atoms.
void choose_cutoff(const Molecule& a, const Molecule& b, FieldModel& model);

}  // namespace tandem::docking
