#include "common/docking/atom_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <tuple>

#include "common/docking/atom_radii.hpp"
#include "common/docking/exact_field.hpp"

namespace tandem::docking {
namespace {

constexpr double kHydrogen_u = 1.5;  // upper limit of the mass of a hydrogen isotope, excluding tritium [u]
constexpr double kBonded_angstrom = 1.25;
constexpr double kHydrogenToAcceptor_angstrom = 2.5, kDonorToAcceptor_angstrom = 3.5;
constexpr double kMaxCosine = -0.5;  // cos 120°: the angle D−H···A of a hydrogen bond must be at least 120°

bool is_hydrogen(const Molecule& molecule, std::size_t atom) {
  return molecule.mass_u[atom] < kHydrogen_u;
}

/// Returns whether the atom is N or O. The mass decides, because a molecule may have no element names.
bool is_polar(const Molecule& molecule, std::size_t atom) {
  constexpr std::array kMasses_u{14.007, 15.999};
  return std::ranges::any_of(kMasses_u,
                             [mass = molecule.mass_u[atom]](double known) { return std::abs(mass - known) < 0.05; });
}

std::vector<std::size_t> atoms_with(const Molecule& molecule, bool (*is)(const Molecule&, std::size_t)) {
  std::vector<std::size_t> atoms;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    if (is(molecule, i)) atoms.push_back(i);
  }
  return atoms;
}

bool is_heavy(const Molecule& molecule, std::size_t atom) {
  return !is_hydrogen(molecule, atom);
}

/// Spatial hash of points. A cell is as wide as the search distance. All neighbours of a point are therefore in its own
/// cell or in one of the 26 cells around that cell.
class Cells {
 public:
  explicit Cells(double width) : width_(width) {}

  void add(std::size_t index, const Vec3& point) { points_.push_back({key(cell(point)), index, point}); }
  void sort() {
    std::ranges::sort(points_, [](const Entry& one, const Entry& other) {
      return std::pair(one.key, one.index) < std::pair(other.key, other.index);
    });
  }

  template <class Found>
  void within_width(const Vec3& of, const Found& found) const {
    const Eigen::Vector3i middle = cell(of);
    for (int i = 0; i < 27; ++i) {
      const Eigen::Vector3i near = middle + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      for (auto at = std::ranges::lower_bound(points_, key(near), {}, &Entry::key);
           at != points_.end() && at->key == key(near); ++at) {
        if ((at->point - of).squaredNorm() <= width_ * width_) found(at->index);
      }
    }
  }

 private:
  struct Entry {
    std::uint64_t key;
    std::size_t index;
    Vec3 point;
  };

  Eigen::Vector3i cell(const Vec3& point) const { return (point / width_).array().floor().cast<int>(); }
  static std::uint64_t key(const Eigen::Vector3i& cell) {
    std::uint64_t key = 0;
    for (const int number : cell) key = key << 21U | (static_cast<std::uint64_t>(number) & 0x1fffffU);
    return key;
  }

  double width_;
  std::vector<Entry> points_;
};

/// Returns the pairs of atoms within `distance` [Å], one of A and one of B. Only the atoms with the indices `of_a` and
/// `of_b` are considered.
AtomPairs near(const Molecule& a, const std::vector<std::size_t>& of_a, const Molecule& b,
               const std::vector<std::size_t>& of_b, const Pose& X_AB, double distance) {
  AtomPairs pairs;
  if (of_b.empty() || !is_evaluable(X_AB)) return pairs;
  Eigen::AlignedBox3d box;
  for (const std::size_t i : of_b) box.extend(X_AB * b.positions_angstrom[i]);
  const Vec3 margin = Vec3::Constant(distance);
  const Eigen::AlignedBox3d reached(box.min() - margin, box.max() + margin);
  Cells cells(distance);
  for (const std::size_t i : of_a) {
    if (reached.contains(a.positions_angstrom[i])) cells.add(i, a.positions_angstrom[i] - box.min());
  }
  cells.sort();
  for (const std::size_t i : of_b) {
    cells.within_width(X_AB * b.positions_angstrom[i] - box.min(),
                       [&pairs, i](std::size_t other) { pairs.emplace_back(other, i); });
  }
  std::ranges::sort(pairs);
  return pairs;
}

/// Returns the donor of each hydrogen: the N or O atom to which it is covalently bound. Empty for a hydrogen without
/// such a bond, and for all other atoms.
std::vector<std::optional<std::size_t>> donors(const Molecule& molecule, const std::vector<std::size_t>& hydrogens,
                                               const std::vector<std::size_t>& polar) {
  std::vector<std::optional<std::size_t>> donors(molecule.size());
  const AtomPairs bonds = near(molecule, hydrogens, molecule, polar, Pose{}, kBonded_angstrom);
  for (const auto& [hydrogen, donor] : bonds) donors[hydrogen] = donor;
  return donors;
}

/// Returns the hydrogen bonds with a donor in molecule `d` and an acceptor in molecule `a`.
AtomPairs bonds_from(const Molecule& d, const Molecule& a, const Pose& X_DA) {
  const std::vector<std::size_t> hydrogens = atoms_with(d, is_hydrogen), donating = atoms_with(d, is_polar);
  const std::vector<std::size_t> accepting = atoms_with(a, is_polar);
  if (hydrogens.empty()) return near(d, donating, a, accepting, X_DA, kDonorToAcceptor_angstrom);
  const std::vector<std::optional<std::size_t>> donor_of = donors(d, hydrogens, donating);
  AtomPairs bonds;
  for (const auto& [hydrogen, acceptor] : near(d, hydrogens, a, accepting, X_DA, kHydrogenToAcceptor_angstrom)) {
    if (!donor_of[hydrogen]) continue;
    const Vec3& h = d.positions_angstrom[hydrogen];
    const Vec3 to_donor = (d.positions_angstrom[*donor_of[hydrogen]] - h).normalized();
    const Vec3 to_acceptor = (X_DA * a.positions_angstrom[acceptor] - h).normalized();
    if (to_donor.dot(to_acceptor) <= kMaxCosine) bonds.emplace_back(*donor_of[hydrogen], acceptor);
  }
  return bonds;
}

}  // namespace

AtomPairs atom_contacts(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom) {
  return near(a, atoms_with(a, is_heavy), b, atoms_with(b, is_heavy), X_AB_angstrom, kContactAngstrom);
}

AtomPairs hydrogen_bonds(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom) {
  if (!is_evaluable(X_AB_angstrom)) return {};
  AtomPairs bonds = bonds_from(a, b, X_AB_angstrom);
  for (const auto& [donor, acceptor] : bonds_from(b, a, X_AB_angstrom.inverse())) bonds.emplace_back(acceptor, donor);
  std::ranges::sort(bonds);
  const auto repeated = std::ranges::unique(bonds);
  bonds.erase(repeated.begin(), repeated.end());
  return bonds;
}

std::vector<CloseAtoms> close_atoms(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom) {
  constexpr double kMaxRadiusAngstrom = 2.75;
  constexpr auto kAny = [](const Molecule&, std::size_t) { return true; };
  const std::vector<std::size_t> of_a = atoms_with(a, kAny), of_b = atoms_with(b, kAny);
  std::vector<CloseAtoms> found;
  const auto polar_hydrogens = [](const Molecule& molecule) {
    return donors(molecule, atoms_with(molecule, is_hydrogen), atoms_with(molecule, is_polar));
  };
  const auto donors_of_a = polar_hydrogens(a), donors_of_b = polar_hydrogens(b);
  for (const auto& [i, j] : near(a, of_a, b, of_b, X_AB_angstrom, 2 * kClashShare * kMaxRadiusAngstrom)) {
    const AtomRadii &radii_i = atom_radii(a, i), &radii_j = atom_radii(b, j);
    CloseAtoms pair{i, j, (X_AB_angstrom * b.positions_angstrom[j] - a.positions_angstrom[i]).norm(), 0, {}};
    pair.share = pair.distance_angstrom / (radii_i.van_der_waals_angstrom + radii_j.van_der_waals_angstrom);
    if (pair.share >= kClashShare) continue;
    const bool is_hydrogen_bond = (donors_of_a[i] && is_polar(b, j)) || (donors_of_b[j] && is_polar(a, i));
    const double bond_angstrom = radii_i.covalent_angstrom + radii_j.covalent_angstrom + kBondSlackAngstrom;
    if (is_hydrogen_bond && pair.distance_angstrom >= kMinHydrogenBondAngstrom) {
      pair.closeness = Closeness::kHydrogenBond;
    } else if (is_heavy(a, i) && is_heavy(b, j) && pair.distance_angstrom < bond_angstrom) {
      pair.closeness = Closeness::kBond;
    }
    found.push_back(pair);
  }
  std::ranges::sort(found, {}, [](const CloseAtoms& pair) { return std::tuple(pair.share, pair.a, pair.b); });
  return found;
}

double rmsd_angstrom(const Molecule& molecule, const Pose& X_1_angstrom, const Pose& X_2_angstrom) {
  double sum = 0;
  for (const Vec3& position : molecule.positions_angstrom) {
    sum += (X_1_angstrom * position - X_2_angstrom * position).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, molecule.size())));
}

}  // namespace tandem::docking
