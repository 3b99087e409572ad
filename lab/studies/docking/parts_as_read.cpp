#include "lab/studies/docking/parts_as_read.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "common/docking/exact_field.hpp"
#include "lab/metrics/capri.hpp"
#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

using docking::Molecule;

struct BondRule {
  std::string_view one, other;  ///< names of the two bonded atoms, in either order
  double within_angstrom;
};
constexpr std::array kBondRules{BondRule{"SG", "SG", 2.5}, BondRule{"C", "N", 1.7}, BondRule{"O3'", "P", 1.7}};

std::vector<std::size_t> atoms_named(const Molecule& molecule, std::string_view name) {
  std::vector<std::size_t> atoms;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    if (molecule.atom_names[i] == name) atoms.push_back(i);
  }
  return atoms;
}

std::vector<std::size_t> all_heavy_atoms(const Molecule& molecule) {
  std::vector<std::size_t> atoms;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    if (molecule.elements[i] != "H" && molecule.elements[i] != "D") atoms.push_back(i);
  }
  return atoms;
}

double distance_angstrom(const Molecule& a, const Molecule& b, const Pose& X_AB,
                         std::pair<std::size_t, std::size_t> atoms) {
  return (a.positions_angstrom[atoms.first] - X_AB * b.positions_angstrom[atoms.second]).norm();
}

std::optional<std::pair<std::size_t, std::size_t>> nearest_of(const Molecule& a, const std::vector<std::size_t>& of_a,
                                                              const Molecule& b, const std::vector<std::size_t>& of_b,
                                                              const Pose& X_AB) {
  std::optional<std::pair<std::size_t, std::size_t>> nearest;
  double least2 = std::numeric_limits<double>::infinity();
  for (const std::size_t j : of_b) {
    const Vec3 there = X_AB * b.positions_angstrom[j];
    for (const std::size_t i : of_a) {
      const double distance2 = (a.positions_angstrom[i] - there).squaredNorm();
      if (distance2 >= least2) continue;
      least2 = distance2;
      nearest = {i, j};
    }
  }
  return nearest;
}

std::optional<std::pair<std::size_t, std::size_t>> bond_between(const Molecule& a, const Molecule& b,
                                                                const Pose& X_AB) {
  for (const BondRule& rule : kBondRules) {
    for (const auto& [of_a, of_b] : {std::pair(rule.one, rule.other), std::pair(rule.other, rule.one)}) {
      const auto nearest = nearest_of(a, atoms_named(a, of_a), b, atoms_named(b, of_b), X_AB);
      if (nearest && distance_angstrom(a, b, X_AB, *nearest) <= rule.within_angstrom) return nearest;
    }
  }
  return std::nullopt;
}

/// Returns a description of the residue of `atom`, e.g. "CYS 7 of chain A".
std::string residue_text(const Molecule& molecule, std::size_t atom) {
  const std::string& chain = molecule.chains[atom];
  return molecule.residue_names[atom] + " " + molecule.residue_ids[atom] + (chain.empty() ? "" : " of chain " + chain);
}

std::string highest_residue_text(const Molecule& molecule, std::span<const Eigen::Vector2d> atom_energies) {
  const std::vector<Eigen::Vector2d> energies = docking::residue_energies(molecule, atom_energies);
  const auto lennard_jones = [](const Eigen::Vector2d& energy) { return energy[0]; };
  const auto highest = std::ranges::max_element(energies, {}, lennard_jones);
  const std::size_t atom = docking::residue_starts(molecule)[static_cast<std::size_t>(highest - energies.begin())];
  return residue_text(molecule, atom) + " (" +
         format_fixed(lennard_jones(*highest) / docking::kKilojoulesPerKilocalorie, 1) + " kcal/mol)";
}

}  // namespace

std::string place_text(const Molecule& molecule, std::size_t atom) {
  return molecule.atom_names[atom] + " of " + residue_text(molecule, atom);
}

std::optional<std::pair<std::size_t, std::size_t>> nearest_atoms(const Molecule& a, const Molecule& b,
                                                                 const Pose& X_AB) {
  return nearest_of(a, all_heavy_atoms(a), b, all_heavy_atoms(b), X_AB);
}

std::string distance_text(const Molecule& a, const Molecule& b, const Pose& X_AB,
                          std::pair<std::size_t, std::size_t> atoms) {
  return place_text(a, atoms.first) + " and " + place_text(b, atoms.second) + " are " +
         format_fixed(distance_angstrom(a, b, X_AB, atoms), 2) + " Å apart";
}

std::string strongest_repulsion_text(const Molecule& a, const Molecule& b, const Pose& X_AB) {
  docking::FieldModel walls;
  walls.dielectric = docking::Dielectric::kNone;
  std::vector<Eigen::Vector2d> of_a, of_b;
  docking::ExactDetails details;
  details.energies_of_a = &of_a;
  details.energies_of_b = &of_b;
  docking::exact_field(a, b, X_AB, walls, details);
  return highest_residue_text(a, of_a) + " and " + highest_residue_text(b, of_b);
}

void require_complex_as_read(const Molecule& a, const Molecule& b, const Pose& native_X_AB) {
  const auto nearest = nearest_atoms(a, b, native_X_AB);
  const std::string apart = nearest ? distance_text(a, b, native_X_AB, *nearest) : "one of them has no heavy atoms";
  if (nearest && distance_angstrom(a, b, native_X_AB, *nearest) < kOnePlace_angstrom) {
    throw std::invalid_argument("receptor and ligand are no complex, they overlap: " + apart +
                                "; name two parts of one complex");
  }
  const auto bond = bond_between(a, b, native_X_AB);
  if (bond) {
    throw std::invalid_argument("a bond joins receptor and ligand: " + distance_text(a, b, native_X_AB, *bond) +
                                "; the field has no bonds between them; name two parts of one complex without a bond");
  }
  if (residue_pairs_within(a, b, native_X_AB, kResidueContact_angstrom).empty()) {
    throw std::invalid_argument(
        "receptor and ligand are no complex, no residues are within 5 Å: " + apart +
        "; name two parts of one complex in the same frame: chains of one file, or files superposed on it");
  }
}

}  // namespace tandem::lab
