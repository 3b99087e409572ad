#include "lab/metrics/capri.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <string_view>

namespace tandem::lab {
namespace {

using docking::Molecule;
using ResiduePairs = std::vector<std::pair<std::size_t, std::size_t>>;

constexpr std::array<std::string_view, 4> kAminoAcidBackbone{"N", "CA", "C", "O"};
constexpr std::array<std::string_view, 6> kNucleotideBackbone{"P", "O5'", "C5'", "C4'", "C3'", "O3'"};
/// Names of backbone atoms that identify the kind of a residue: the first three of an amino acid, and the last four of
/// a nucleotide. The atoms P and O5' are not used, because the first nucleotide of a chain may lack the phosphate.
constexpr std::span kAminoAcidMarks = std::span(kAminoAcidBackbone).first<3>();
constexpr std::span kNucleotideMarks = std::span(kNucleotideBackbone).last<4>();

bool is_heavy_atom(const Molecule& molecule, std::size_t atom) {
  return molecule.elements.empty() || (molecule.elements[atom] != "H" && molecule.elements[atom] != "D");
}

std::vector<std::size_t> heavy_atoms(const Molecule& molecule) {
  std::vector<std::size_t> atoms;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    if (is_heavy_atom(molecule, i)) atoms.push_back(i);
  }
  return atoms;
}

/// Returns, for each atom, the index of its residue.
std::vector<std::size_t> residues_of_atoms(const Molecule& molecule) {
  const std::vector<std::size_t> starts = docking::residue_starts(molecule);
  std::vector<std::size_t> residues(molecule.size());
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    residues[i] = static_cast<std::size_t>(std::ranges::upper_bound(starts, i) - starts.begin()) - 1;
  }
  return residues;
}

/// Returns the atoms of one residue (`atoms`) whose names are in `names`.
std::vector<std::size_t> atoms_called(const Molecule& molecule, std::span<const std::size_t> atoms,
                                      std::span<const std::string_view> names) {
  std::vector<std::size_t> found;
  for (const std::size_t i : atoms) {
    if (std::ranges::find(names, molecule.atom_names[i]) != names.end()) found.push_back(i);
  }
  return found;
}

/// Returns the atoms of a residue that the interface RMSD uses: those of its backbone, or all heavy atoms if the
/// backbone is incomplete. `atoms` are the heavy atoms of the residue.
std::vector<std::size_t> backbone_or_all(const Molecule& molecule, const std::vector<std::size_t>& atoms) {
  const auto has_all = [&](std::span<const std::string_view> names) {
    return atoms_called(molecule, atoms, names).size() >= names.size();
  };
  if (has_all(kAminoAcidMarks)) return atoms_called(molecule, atoms, kAminoAcidBackbone);
  if (has_all(kNucleotideMarks)) return atoms_called(molecule, atoms, kNucleotideBackbone);
  return atoms;
}

std::vector<std::size_t> interface_atoms(const Molecule& molecule, const std::set<std::size_t>& interface_residues) {
  const std::vector<std::size_t> residues = residues_of_atoms(molecule);
  std::vector<std::vector<std::size_t>> atoms_of(residues.empty() ? 0 : residues.back() + 1);
  for (const std::size_t i : heavy_atoms(molecule)) atoms_of[residues[i]].push_back(i);
  std::vector<std::size_t> atoms;
  for (const std::size_t residue : interface_residues) {
    for (const std::size_t i : backbone_or_all(molecule, atoms_of[residue])) atoms.push_back(i);
  }
  return atoms;
}

/// Returns the RMSD after the optimal superposition by Umeyama's method. Columns are points.
double superposed_rmsd(const Eigen::Matrix3Xd& moving, const Eigen::Matrix3Xd& fixed) {
  const Eigen::Matrix4d best = Eigen::umeyama(moving, fixed, false);
  const Eigen::Matrix3Xd rest = (best.topLeftCorner<3, 3>() * moving).colwise() + best.topRightCorner<3, 1>().eval();
  return std::sqrt((rest - fixed).squaredNorm() / static_cast<double>(fixed.cols()));
}

}  // namespace

ResiduePairs residue_pairs_within(const Molecule& a, const Molecule& b, const Pose& X_AB, double distance_angstrom) {
  const std::vector<std::size_t> residues_a = residues_of_atoms(a), residues_b = residues_of_atoms(b);
  const std::vector<std::size_t> of_b = heavy_atoms(b);
  Eigen::AlignedBox3d box;
  std::vector<Vec3> in_a;
  for (const std::size_t j : of_b) {
    in_a.push_back(X_AB * b.positions_angstrom[j]);
    box.extend(in_a.back());
  }
  const double distance2 = distance_angstrom * distance_angstrom;
  ResiduePairs pairs;
  for (const std::size_t i : heavy_atoms(a)) {
    const Vec3& position = a.positions_angstrom[i];
    if (box.isEmpty() || box.squaredExteriorDistance(position) > distance2) continue;
    for (std::size_t k = 0; k < of_b.size(); ++k) {
      if ((in_a[k] - position).squaredNorm() <= distance2) pairs.emplace_back(residues_a[i], residues_b[of_b[k]]);
    }
  }
  std::ranges::sort(pairs);
  const auto repeated = std::ranges::unique(pairs);
  pairs.erase(repeated.begin(), repeated.end());
  return pairs;
}

double ligand_rmsd_angstrom(const Molecule& ligand, const Pose& X_AB, const Pose& Y_AB) {
  double sum = 0;
  const std::vector<std::size_t> atoms = heavy_atoms(ligand);
  for (const std::size_t i : atoms) {
    sum += (X_AB * ligand.positions_angstrom[i] - Y_AB * ligand.positions_angstrom[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, atoms.size())));
}

double native_contact_share(const Molecule& a, const Molecule& b, const Pose& native_X_AB, const Pose& X_AB) {
  const ResiduePairs native = residue_pairs_within(a, b, native_X_AB, kResidueContact_angstrom);
  if (native.empty()) return std::numeric_limits<double>::quiet_NaN();
  const ResiduePairs here = residue_pairs_within(a, b, X_AB, kResidueContact_angstrom);
  const auto kept =
      std::ranges::count_if(native, [&](const auto& pair) { return std::ranges::binary_search(here, pair); });
  return static_cast<double>(kept) / static_cast<double>(native.size());
}

double interface_rmsd_angstrom(const Molecule& a, const Molecule& b, const Pose& native_X_AB, const Pose& X_AB) {
  std::set<std::size_t> residues_a, residues_b;
  for (const auto& [residue_a, residue_b] : residue_pairs_within(a, b, native_X_AB, kInterfaceReach_angstrom)) {
    residues_a.insert(residue_a);
    residues_b.insert(residue_b);
  }
  const std::vector<std::size_t> atoms_a = interface_atoms(a, residues_a), atoms_b = interface_atoms(b, residues_b);
  const auto count = static_cast<Eigen::Index>(atoms_a.size() + atoms_b.size());
  if (count == 0) return std::numeric_limits<double>::quiet_NaN();
  Eigen::Matrix3Xd native(3, count), here(3, count);
  Eigen::Index column = 0;
  for (const std::size_t i : atoms_a) {
    native.col(column) = here.col(column) = a.positions_angstrom[i];
    ++column;
  }
  for (const std::size_t i : atoms_b) {
    native.col(column) = native_X_AB * b.positions_angstrom[i];
    here.col(column) = X_AB * b.positions_angstrom[i];
    ++column;
  }
  return superposed_rmsd(here, native);
}

}  // namespace tandem::lab
