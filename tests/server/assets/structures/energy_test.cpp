// Compares energies and forces of real pairs with built hydrogens with results of LAMMPS in a golden file. The tests
// detect wrong parameters, wrong hydrogens and wrong sums.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "server/assets/structures/loader.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::server {
namespace {

TEST(RealPairs, HaveTheEnergiesAndForcesOfLammps) {
  std::ifstream golden(test::source_path("tests/golden/docking_pairs.txt"));
  ASSERT_TRUE(golden);
  std::size_t compared = 0;
  for (std::string line; std::getline(golden, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    std::string name, file, chain_a, chain_b, force_field, dielectric;
    double lennard_jones = 0, coulomb = 0;
    Vec3 force;
    words >> name >> file >> chain_a >> chain_b >> force_field >> dielectric >> lennard_jones >> coulomb >> force.x() >>
        force.y() >> force.z();
    ASSERT_TRUE(words) << line;
    const std::filesystem::path parameters = test::kOplsDirectory.parent_path() / (force_field + ".ff");
    TANDEM_NEEDS_FILES(file, parameters);
    const docking::Molecule a = load_molecule(file, {{chain_a}}, parameters, Hydrogens::kBuild);
    const docking::Molecule b = load_molecule(file, {{chain_b}}, parameters, Hydrogens::kBuild);
    docking::FieldModel model;
    model.dielectric = dielectric == "4r" ? docking::Dielectric::kDistance : docking::Dielectric::kConstant;
    model.permittivity = dielectric == "4r" ? 4 : 1;
    const docking::FieldResult exact = docking::exact_field(a, b, Pose{}, model);
    EXPECT_NEAR(exact.lennard_jones_kj_per_mol, lennard_jones, 1e-8 * std::abs(lennard_jones)) << line;
    EXPECT_NEAR(exact.coulomb_kj_per_mol, coulomb, 1e-7 * std::abs(coulomb)) << line;
    EXPECT_LT((exact.force_on_b - force).norm(), 1e-6 * force.norm()) << line;
    for (const std::string_view kernel : docking::MolecularField::available_kernels()) {
      const docking::FieldResult result = docking::MolecularField(a, b, model, kernel).evaluate(Pose{});
      EXPECT_NEAR(result.lennard_jones_kj_per_mol, lennard_jones, 1e-5 * std::abs(lennard_jones)) << kernel << line;
      // Tolerance of the electrostatic energy. Its positive and negative terms are large and almost cancel, but their
      // rounding errors in single precision remain. Terms of about 10^6 kJ/mol leave an error of about 0.003 kJ/mol.
      const double rounded = 1e-5 * std::abs(lennard_jones) + 1e-6 * std::abs(coulomb);
      EXPECT_NEAR(result.coulomb_kj_per_mol, coulomb, rounded) << kernel << line;
    }
    ++compared;
  }
  EXPECT_EQ(compared, 8U);
}

}  // namespace
}  // namespace tandem::server
