#include "server/assets/field_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/docking/molecular_field.hpp"
#include "proto/scene_ranges.hpp"
#include "server/assets/molecular_scale.hpp"

namespace tandem::server {
namespace {

using docking::FieldModel;
using docking::Molecule;

constexpr std::size_t kMaxReferencePairs = 200'000'000;
/// Cut-off of the reference sum if there are more than kMaxReferencePairs pairs.
constexpr double kReferenceCutoff_angstrom = 40;
/// Number of pairs within the cut-off that one core with AVX-512 sums in a third of a millisecond. Without a cut-off,
/// docking::kMaxAllPairs pairs take as long.
constexpr std::size_t kMaxNearPairs = 200'000;
/// Distances between molecule B and its contact position at which the fields are evaluated. The distance 0 comes last,
/// because WellCheck::pairs is the number of pairs in the last evaluation.
constexpr std::array kOut_angstrom{5.0, 3.5, 2.0, 1.0, 0.5, 0.0};
constexpr std::array kCutoffs_angstrom{8.0, 9.0, 10.0, 11.0, 12.0, 14.0, 16.0, 20.0, 25.0, 30.0};

FieldModel with_cutoff(FieldModel model, double cutoff_angstrom) {
  model.cutoff_angstrom = cutoff_angstrom;
  model.has_far_grid = false;
  return model;
}

/// Formats a number with two significant digits.
std::string short_number(double value) {
  const double step = std::pow(10, std::floor(std::log10(std::max(1e-12, std::abs(value)))) - 1);
  return proto::number_text(std::round(value / step) * step);
}

}  // namespace

std::function<WellCheck(const FieldModel&)> way_in(const Molecule& a, const Molecule& b, const FieldModel& model,
                                                   const Vec3& direction_A) {
  const FieldModel near = with_cutoff(model, docking::kUsualCutoffAngstrom);
  const double contact = contact_distance_angstrom(a, b, near, direction_A);
  const auto energies = [=](docking::MolecularField& field) {
    std::array<double, kOut_angstrom.size()> found{};
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Pose X_AB{(contact + kOut_angstrom.at(i)) * direction_A, Quat::Identity()};
      found.at(i) = field.evaluate(X_AB).energy_kj_per_mol();
    }
    return found;
  };
  const double cutoff = a.size() * b.size() <= kMaxReferencePairs ? 0 : kReferenceCutoff_angstrom;
  docking::MolecularField reference(a, b, with_cutoff(model, cutoff));
  return [=, &a, &b, all = energies(reference)](const FieldModel& checked) {
    docking::MolecularField field(a, b, checked);
    const auto found = energies(field);
    WellCheck check;
    check.reference_cutoff_angstrom = cutoff;
    check.pairs = field.pair_count();
    for (std::size_t i = 0; i < all.size(); ++i) {
      check.well_kj_per_mol = std::min(check.well_kj_per_mol, all.at(i));
      check.error_kj_per_mol = std::max(check.error_kj_per_mol, std::abs(found.at(i) - all.at(i)));
    }
    return check;
  };
}

Vec3 line_of_centres(const Vec3& offset_A) {
  return offset_A.norm() > 1 ? Vec3(offset_A.normalized()) : Vec3(Vec3::UnitY());
}

void choose_field(const Molecule& a, const Molecule& b, const Vec3& offset_A, FieldModel& model) {
  docking::choose_cutoff(a, b, model);
  if (model.cutoff_angstrom == 0 || model.has_far_grid) return;
  const auto check_of = way_in(a, b, model, line_of_centres(offset_A));
  double least = std::numeric_limits<double>::infinity();
  for (const double cutoff : kCutoffs_angstrom) {
    const FieldModel candidate = with_cutoff(model, cutoff);
    const WellCheck check = check_of(candidate);
    if (cutoff > kCutoffs_angstrom.front() && check.pairs > kMaxNearPairs) break;
    if (check.error_kj_per_mol >= least) continue;
    least = check.error_kj_per_mol;
    model = candidate;
    if (check.is_kept()) break;
  }
}

std::string well_note(const WellCheck& check) {
  const std::string reference =
      check.reference_cutoff_angstrom == 0
          ? "all pairs"
          : "the pairs within " + proto::number_text(check.reference_cutoff_angstrom) + " angstrom";
  const std::string where = " on the way in along the line of centres";
  if (check.well_kj_per_mol >= 0) {
    return "no well" + where + "; the energy differs from that of " + reference + " by up to " +
           short_number(check.error_kj_per_mol) + " kJ/mol";
  }
  const std::string text = "energy differs from that of " + reference + " by up to " +
                           short_number(100 * check.error_kj_per_mol / -check.well_kj_per_mol) + " % of the well of " +
                           short_number(check.well_kj_per_mol) + " kJ/mol" + where;
  if (check.is_kept()) return text;
  return "doubtful: " + text +
         "; give molecular_field.far_grid (--far-grid), a larger cutoff_angstrom (--cutoff), or fewer " +
         "atoms (molecule.chains)";
}

}  // namespace tandem::server
