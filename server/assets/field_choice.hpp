// Chooses the field between two molecules by default, and checks how well a field reproduces the energy well.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::server {

/// Largest error of a field, as a fraction of the well depth, that is not reported to the user.
inline constexpr double kKeptWell = 0.05;

/// Comparison of a field with the sum over all pairs, along a straight approach of the molecules.
struct WellCheck {
  double well_kj_per_mol = 0;            ///< lowest energy of the sum over all pairs on the approach
  double error_kj_per_mol = 0;           ///< largest difference from that sum on the approach
  double reference_cutoff_angstrom = 0;  ///< cut-off of the reference sum for large molecules; 0: all pairs are summed
  std::size_t pairs = 0;                 ///< number of pairs that the field evaluates at contact

  bool is_kept() const { return error_kj_per_mol <= -kKeptWell * well_kj_per_mol; }
};

/// Returns a function that checks fields along a straight approach of B to A, from 5 Å to contact. The orientations are
/// those of the files.
///
/// In      a, b         positions relative to their own centres; must outlive the returned function
///         model        gives the dielectric
///         direction_A  unit vector from A to B
/// Cost    six evaluations of all pairs, if there are at most 2e8 of them: about 0.1 s each
std::function<WellCheck(const docking::FieldModel&)> way_in(const docking::Molecule& a, const docking::Molecule& b,
                                                            const docking::FieldModel& model, const Vec3& direction_A);

/// Chooses cut-off and grid by docking::choose_cutoff(). If that finds no grid for a large pair, it chooses the
/// smallest acceptable cut-off. A cut-off is acceptable if the energy well differs from that of all pairs by less than
/// kKeptWell, and if its cost is at most a third of a millisecond of an AVX-512 core. If there is none, it chooses the
/// cut-off with the smallest error at that cost.
///
/// In      model        gives the dielectric
///         offset_A     vector from the centre of A to that of B [Å]
void choose_field(const docking::Molecule& a, const docking::Molecule& b, const Vec3& offset_A,
                  docking::FieldModel& model);

/// Returns the unit vector along the line of centres; y if the centres coincide.
Vec3 line_of_centres(const Vec3& offset_A);

/// Returns a note for the user: the error of a field with a cut-off as a fraction of the well, and the remedy if it is
/// too large.
std::string well_note(const WellCheck& check);

}  // namespace tandem::server
