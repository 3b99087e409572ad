// Compares exact field and kernels with LAMMPS for a real pair of molecules. The results of LAMMPS are in a file,
// written by tests/docking_lammps (see its README.md), so LAMMPS is not needed here.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "server/assets/structures/loader.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::docking {
namespace {

struct Golden {
  std::string name;
  Pose X_AB;
  double energy_kj_per_mol = 0;
  std::vector<Vec3> forces;  ///< forces on the atoms of A, then on the atoms of B [kJ/mol/Å]
};

std::vector<Golden> read_golden(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<Golden> poses;
  std::string line;
  while (std::getline(file, line)) {
    if (line.starts_with("#")) continue;
    if (!line.starts_with("pose ")) {
      std::istringstream numbers(line);
      Vec3& force = poses.at(poses.size() - 1).forces.emplace_back();
      numbers >> force.x() >> force.y() >> force.z();
      continue;
    }
    Golden& pose = poses.emplace_back();
    pose.name = line.substr(5);
    Quat& q = pose.X_AB.q;
    file >> pose.X_AB.p.x() >> pose.X_AB.p.y() >> pose.X_AB.p.z() >> q.w() >> q.x() >> q.y() >> q.z();
    file >> pose.energy_kj_per_mol >> std::ws;
    q.normalize();
  }
  return poses;
}

class AgainstLammps : public testing::Test {
 protected:
  void SetUp() override {
    TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
    a_ = server::load_molecule(test::k3al1File, {{"A"}}, test::kOplsDirectory);
    b_ = server::load_molecule(test::k3al1File, {{"B"}}, test::kOplsDirectory);
    poses_ = read_golden(test::source_path("tests/golden/3al1_lammps.txt").string());
    ASSERT_EQ(poses_.size(), 2U);
    for (const Golden& golden : poses_) ASSERT_EQ(golden.forces.size(), a_.size() + b_.size());
  }

  Molecule a_;
  Molecule b_;
  std::vector<Golden> poses_;
};

double largest_of(const std::vector<Vec3>& vectors) {
  double largest = 0;
  for (const Vec3& v : vectors) largest = std::max(largest, v.norm());
  return largest;
}

TEST_F(AgainstLammps, TheDoubleKernelAgreesInEnergyAndEveryAtomForceTo1e8) {
  for (const Golden& golden : poses_) {
    std::vector<Vec3> forces;
    std::vector<Vec3> on_b;
    const FieldResult result = exact_field(a_, b_, golden.X_AB, {}, {&forces, &on_b});
    forces.insert(forces.end(), on_b.begin(), on_b.end());
    EXPECT_NEAR(result.energy_kj_per_mol(), golden.energy_kj_per_mol, 1e-8 * std::abs(golden.energy_kj_per_mol));
    // Where the pair forces on an atom almost cancel (below 1e-6 of the largest force), the text file has too few
    // significant digits for a relative comparison.
    const double floor = 1e-6 * largest_of(golden.forces);
    for (std::size_t i = 0; i < forces.size(); ++i) {
      EXPECT_LE((forces[i] - golden.forces[i]).norm(), 1e-8 * std::max(golden.forces[i].norm(), floor))
          << "atom " << i << ", pose " << golden.name;
    }
  }
}

TEST_F(AgainstLammps, TheFloatKernelsAgreeTo1e5OfTheLargestAtomForce) {
  for (const Golden& golden : poses_) {
    const double largest = largest_of(golden.forces);
    Vec3 force = Vec3::Zero();
    Vec3 torque = Vec3::Zero();
    double reach = 0;
    for (std::size_t j = 0; j < b_.size(); ++j) {
      const Vec3 arm = golden.X_AB.q * b_.positions_angstrom[j];
      force += golden.forces[a_.size() + j];
      torque += arm.cross(golden.forces[a_.size() + j]);
      reach = std::max(reach, arm.norm());
    }
    for (const std::string_view kernel : MolecularField::available_kernels()) {
      const FieldResult result = MolecularField(a_, b_, {}, kernel).evaluate(golden.X_AB);
      EXPECT_NEAR(result.energy_kj_per_mol(), golden.energy_kj_per_mol, 1e-5 * std::abs(golden.energy_kj_per_mol));
      EXPECT_LT((result.force_on_b - force).norm(), 1e-5 * largest) << kernel << ", pose " << golden.name;
      EXPECT_LT((result.torque_on_b - torque).norm(), 1e-5 * largest * reach) << kernel << ", pose " << golden.name;
    }
  }
}

Molecule only_atom(const Molecule& all, std::size_t index) {
  Molecule one;
  one.positions_angstrom = {all.positions_angstrom[index]};
  one.sigma_angstrom = {all.sigma_angstrom[index]};
  one.epsilon_kj_per_mol = {all.epsilon_kj_per_mol[index]};
  one.charge_e = {all.charge_e[index]};
  one.mass_u = {all.mass_u[index]};
  one.types = {all.types[index]};
  return one;
}

// A kernel returns only the total force on B. To get the force on a single atom, B is reduced to this atom.
TEST_F(AgainstLammps, TheFloatKernelsGiveEveryAtomForceTo1e5OfTheLargest) {
  for (const Golden& golden : poses_) {
    const double largest = largest_of(golden.forces);
    for (const std::string_view kernel : MolecularField::available_kernels()) {
      for (std::size_t j = 0; j < b_.size(); ++j) {
        const FieldResult result = MolecularField(a_, only_atom(b_, j), {}, kernel).evaluate(golden.X_AB);
        ASSERT_LE((result.force_on_b - golden.forces[a_.size() + j]).norm(), 1e-5 * largest)
            << kernel << ", atom " << j << " of B, pose " << golden.name;
      }
      for (std::size_t i = 0; i < a_.size(); ++i) {
        const FieldResult result = MolecularField(b_, only_atom(a_, i), {}, kernel).evaluate(golden.X_AB.inverse());
        const Vec3 force_A = golden.X_AB.q * result.force_on_b;
        ASSERT_LE((force_A - golden.forces[i]).norm(), 1e-5 * largest)
            << kernel << ", atom " << i << " of A, pose " << golden.name;
      }
    }
  }
}

}  // namespace
}  // namespace tandem::docking
