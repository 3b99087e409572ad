// Molecules for tests: random ones, and files with parameters and structures from Debian packages.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "common/docking/molecule.hpp"

namespace tandem::test {

inline const std::filesystem::path kOplsDirectory = "/usr/share/gromacs/top/oplsaa.ff";  ///< in the Debian package
                                                                                         // gromacs-data
inline const std::filesystem::path k3al1File = "/usr/share/pymol/test/dat/3al1.pdb";     ///< in the Debian package
                                                                                         // pymol-data

inline docking::Molecule one_atom(double sigma_angstrom, double epsilon_kj_per_mol,
                                  const Vec3& position = Vec3::Zero()) {
  docking::Molecule molecule;
  molecule.positions_angstrom = {position};
  molecule.sigma_angstrom = {sigma_angstrom};
  molecule.epsilon_kj_per_mol = {epsilon_kj_per_mol};
  molecule.charge_e = {0.0};
  molecule.mass_u = {12.0};
  return molecule;
}

/// Returns atoms on a lattice of 3 Å with random displacements in a cube, with parameters in the range of OPLS-AA. One
/// atom in six has no Lennard-Jones parameters.
inline docking::Molecule random_molecule(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const auto edge = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(count))));
  docking::Molecule molecule;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 cell(static_cast<double>(i % edge), static_cast<double>(i / edge % edge),
                    static_cast<double>(i / edge / edge));
    const Vec3 jitter(uniform(random), uniform(random), uniform(random));
    const bool polar_hydrogen = uniform(random) < 1.0 / 6.0;
    molecule.positions_angstrom.push_back(3.0 * cell + jitter);
    molecule.sigma_angstrom.push_back(polar_hydrogen ? 0.0 : 2.4 + 1.4 * uniform(random));
    molecule.epsilon_kj_per_mol.push_back(polar_hydrogen ? 0.0 : 0.1 + 1.3 * uniform(random));
    molecule.charge_e.push_back(0.0);
    molecule.mass_u.push_back(1.0 + 15.0 * uniform(random));
  }
  return molecule;
}

/// Returns atoms in a ball about the origin, with the density of a protein, in groups of ten atoms. One group in eight
/// has a net charge of ±1 e, and 55 % of these charges have the sign `sign`.
inline docking::Molecule protein_like(std::size_t count, double sign, std::mt19937& random) {
  constexpr double kCellAngstrom = 2.15;
  std::uniform_real_distribution<double> uniform(0, 1);
  const double radius = std::cbrt(3 * static_cast<double>(count) / 4 / 3.14159) + 1;
  const int cells = static_cast<int>(radius) + 1;
  std::vector<Vec3> places;
  for (int z = -cells; z <= cells; ++z) {
    for (int y = -cells; y <= cells; ++y) {
      for (int x = -cells; x <= cells; ++x) places.emplace_back(x, y, z);
    }
  }
  std::ranges::stable_sort(places, {}, [](const Vec3& place) { return place.squaredNorm(); });
  places.resize(count);
  docking::Molecule molecule;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 jitter(uniform(random), uniform(random), uniform(random));
    molecule.positions_angstrom.push_back(kCellAngstrom * (places[i] + 0.3 * jitter));
    molecule.sigma_angstrom.push_back(2.5 + 1.2 * uniform(random));
    molecule.epsilon_kj_per_mol.push_back(0.1 + 0.5 * uniform(random));
    molecule.charge_e.push_back(uniform(random) - 0.5);
    molecule.mass_u.push_back(12);
  }
  for (std::size_t first = 0; first < count; first += 10) {
    const std::size_t end = std::min(first + 10, count);
    double sum = uniform(random) < 0.125 ? (uniform(random) < 0.55 ? -sign : sign) : 0;
    for (std::size_t i = first; i < end; ++i) sum += molecule.charge_e[i];
    for (std::size_t i = first; i < end; ++i) molecule.charge_e[i] -= sum / static_cast<double>(end - first);
  }
  return molecule;
}

inline Quat random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Quat(normal(random), normal(random), normal(random), normal(random)).normalized();
}

}  // namespace tandem::test
