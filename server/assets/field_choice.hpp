// What is summed between two molecules where nobody says, and how much of the well of all pairs that keeps.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::server {

/// The largest error of a field that is not reported as doubtful, in parts of the well.
inline constexpr double kKeptWell = 0.05;

/// A field against all pairs, on the way in.
struct WellCheck {
  double well_kj_per_mol = 0;            ///< least energy of all pairs
  double error_kj_per_mol = 0;           ///< largest difference on the way
  double reference_cutoff_angstrom = 0;  ///< 0: all pairs; else too many for that, and only what is within this
  std::size_t pairs = 0;                 ///< that the field evaluated at contact

  bool is_kept() const { return error_kj_per_mol <= -kKeptWell * well_kj_per_mol; }
};

/// Checks fields on the way of B along a line towards A, as their files turn them, from 5 Å out to contact.
///
/// In      a, b         about their centres; they outlive what is returned
///         model        the dielectric
///         direction_A  unit vector from A to B
/// Cost    six evaluations of all pairs up to 2e8 of them: some 0.1 s each
std::function<WellCheck(const docking::FieldModel&)> way_in(const docking::Molecule& a, const docking::Molecule& b,
                                                            const docking::FieldModel& model, const Vec3& direction_A);

/// docking::choose_cutoff(); and where that finds no grid for a large pair, the smallest cut-off that keeps the well within
/// kKeptWell of all pairs and takes at most a third of a millisecond of an AVX-512 core; where none does both, the one of
/// that cost with the least error.
///
/// In      model        the dielectric
///         offset_A     from A's centre to B's, Å
void choose_field(const docking::Molecule& a, const docking::Molecule& b, const Vec3& offset_A,
                  docking::FieldModel& model);

/// Unit vector along the line of centres; y where they are at one place.
Vec3 line_of_centres(const Vec3& offset_A);

/// For people: what a field with a cut-off keeps of the well, and the remedy where that is too little.
std::string well_note(const WellCheck& check);

}  // namespace tandem::server
