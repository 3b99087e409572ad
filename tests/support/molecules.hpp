// Molecules for tests: random ones, and what the Debian packages of parameters and structures install.
#pragma once

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <random>
#include <string>

#include "common/docking/molecule.hpp"

namespace tandem::test {

inline const std::filesystem::path kOplsDirectory = "/usr/share/gromacs/top/oplsaa.ff";  ///< gromacs-data
inline const std::filesystem::path k3al1File = "/usr/share/pymol/test/dat/3al1.pdb";     ///< pymol-data

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

/// Atoms on a jittered lattice of 3 Å in a cube, with the parameters' range of OPLS-AA, one in six without any.
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

inline Quat random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Quat(normal(random), normal(random), normal(random), normal(random)).normalized();
}

}  // namespace tandem::test
