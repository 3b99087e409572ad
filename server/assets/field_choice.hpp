// Chooses the default field between two molecules, and checks how well a field reproduces the energy well.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::server {

/// Largest error of a field, as a fraction of the well depth, for which the user gets no warning.
inline constexpr double kKeptWell = 0.05;

/// Comparison of a field with the sum over all pairs, along a straight approach of the molecules.
struct WellCheck {
  double well_kj_per_mol = 0;            ///< lowest energy along the approach, by the sum over all pairs
  double error_kj_per_mol = 0;           ///< largest deviation of the field from that sum along the approach
  double reference_cutoff_angstrom = 0;  ///< cut-off of the reference sum for large molecules; 0: all pairs are summed
  std::size_t pairs = 0;                 ///< number of pairs that the field evaluates at contact

  bool is_kept() const { return error_kj_per_mol <= -kKeptWell * well_kj_per_mol; }
};

/// Returns a function that checks a given field along a straight approach of B to A. The approach ends at contact and
/// begins 5 Å before it. The molecules have the orientations of their files.
///
/// In      a, b         positions relative to their own centres; must outlive the returned function
///         model        defines the dielectric
///         direction_A  unit vector from A to B
/// Cost    six evaluations of all pairs, if there are at most 2e8 of them: about 0.1 s each
std::function<WellCheck(const docking::FieldModel&)> way_in(const docking::Molecule& a, const docking::Molecule& b,
                                                            const docking::FieldModel& model, const Vec3& direction_A);

/// Chooses cut-off and grid by docking::choose_cutoff(). If that function finds no grid for a large pair, the smallest
/// acceptable cut-off is chosen. A cut-off is acceptable under two conditions: the error of the energy well is less
/// than kKeptWell, and the cost is at most a third of a millisecond of an AVX-512 core. If no cut-off is acceptable,
/// the one with the smallest error at that cost is chosen.
///
/// In      model        defines the dielectric
///         offset_A     vector from the centre of A to that of B [Å]
void choose_field(const docking::Molecule& a, const docking::Molecule& b, const Vec3& offset_A,
                  docking::FieldModel& model);

/// Returns the unit vector along the line of centres; y if the centres coincide.
Vec3 line_of_centres(const Vec3& offset_A);

/// Returns a note for the user: the error of a field with a cut-off as a fraction of the well depth, with a remedy if
/// the error is too large.
std::string well_note(const WellCheck& check);

}  // namespace tandem::server
