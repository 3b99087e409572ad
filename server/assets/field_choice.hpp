// Chooses the default field between two molecules, and checks how well a field reproduces the energy well (the
// attractive region near contact).
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::server {

/// Largest error of a field without a warning to the user, as a fraction of the depth of the energy well.
inline constexpr double kKeptWell = 0.05;

/// Comparison of a field with the sum over all pairs, along a straight approach of the molecules.
struct WellCheck {
  double well_kj_per_mol = 0;            ///< lowest energy along the approach, by the sum over all pairs
  double error_kj_per_mol = 0;           ///< largest deviation of the field from that sum along the approach
  double reference_cutoff_angstrom = 0;  ///< cut-off of the reference sum for large molecules; 0: all pairs are summed
  std::size_t pairs = 0;                 ///< number of pairs that the field evaluates at contact

  bool is_kept() const { return error_kj_per_mol <= -kKeptWell * well_kj_per_mol; }
};

/// Returns a function that compares a given field with the sum over all pairs. B approaches A along a straight line,
/// from 5 Å before contact to contact. Both molecules have the orientations of their files.
///
/// In      a, b         positions relative to their own centres; must outlive the returned function
///         model        defines the dielectric
///         direction_A  unit vector from A to B
/// Cost    six evaluations of all pairs, if there are at most 2e8 of them: about 0.1 s each
std::function<WellCheck(const docking::FieldModel&)> way_in(const docking::Molecule& a, const docking::Molecule& b,
                                                            const docking::FieldModel& model, const Vec3& direction_A);

/// Sets cut-off and far-field grid of `model`, in this order of preference:
/// 1. Those of docking::choose_cutoff().
/// 2. For a large pair without a grid, the smallest acceptable cut-off. With it the error of the energy well is less
///    than kKeptWell, and the cost is at most a third of a millisecond of a core with AVX-512.
/// 3. The cut-off with the smallest error among those that meet the limit of the cost.
///
/// In      model        defines the dielectric
///         offset_A     vector from the centre of A to that of B [Å]
void choose_field(const docking::Molecule& a, const docking::Molecule& b, const Vec3& offset_A,
                  docking::FieldModel& model);

/// Returns the unit vector along the line of centres; y if the centres coincide.
Vec3 line_of_centres(const Vec3& offset_A);

/// Returns a note for the user: the error that a field with a cut-off has, as a fraction of the well depth. If the
/// error exceeds kKeptWell, the note includes a remedy.
std::string well_note(const WellCheck& check);

}  // namespace tandem::server
