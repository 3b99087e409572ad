// Default choice of the field between two molecules, and a check of how well a field reproduces the energy well.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::server {

/// Largest error of a field that is not reported as doubtful, as a fraction of the well depth.
inline constexpr double kKeptWell = 0.05;

/// Comparison of a field with the sum over all pairs, along a straight approach.
struct WellCheck {
  double well_kj_per_mol = 0;            ///< least energy of the sum over all pairs on the approach
  double error_kj_per_mol = 0;           ///< largest difference on the approach
  double reference_cutoff_angstrom = 0;  ///< cut-off of the reference, for large molecules; 0: all pairs
  std::size_t pairs = 0;                 ///< evaluated by the field at contact

  bool is_kept() const { return error_kj_per_mol <= -kKeptWell * well_kj_per_mol; }
};

/// Returns a check of fields along a straight approach of B to A, from 5 Å to contact. The orientations are those of
/// the files.
///
/// In      a, b         positions relative to their own centres; must outlive the returned function
///         model        the dielectric
///         direction_A  unit vector from A to B
/// Cost    six evaluations of all pairs up to 2e8 of them: some 0.1 s each
std::function<WellCheck(const docking::FieldModel&)> way_in(const docking::Molecule& a, const docking::Molecule& b,
                                                            const docking::FieldModel& model, const Vec3& direction_A);

/// Chooses cut-off and grid by docking::choose_cutoff(). If that finds no grid for a large pair, takes the smallest
/// cut-off that keeps the well within kKeptWell of all pairs. Its cost is limited to a third of a millisecond of an
/// AVX-512 core. If no cut-off satisfies both, takes the one with the least error at that cost.
///
/// In      model        the dielectric
///         offset_A     from the centre of A to that of B [Å]
void choose_field(const docking::Molecule& a, const docking::Molecule& b, const Vec3& offset_A,
                  docking::FieldModel& model);

/// Unit vector along the line of centres; y if the centres coincide.
Vec3 line_of_centres(const Vec3& offset_A);

/// Note for the user: the error of a field with a cut-off relative to the well, and the remedy if it is too large.
std::string well_note(const WellCheck& check);

}  // namespace tandem::server
