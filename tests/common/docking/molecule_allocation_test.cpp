// Counts the allocations of the whole program, so it is a program separate from molecule_test.cpp.
#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "common/docking/molecular_field.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/molecules.hpp"

namespace tandem::docking {
namespace {

TEST(MolecularField, EvaluateAllocatesNothing) {
  std::mt19937 random(1);
  const Molecule a = test::random_molecule(300, random);
  const Molecule b = test::random_molecule(100, random);
  for (const auto& [cutoff, has_far_grid] : {std::pair(0.0, false), std::pair(8.0, false), std::pair(8.0, true)}) {
    FieldModel model;
    model.cutoff_angstrom = cutoff;
    model.has_far_grid = has_far_grid;
    for (const std::string_view kernel : MolecularField::available_kernels()) {
      if (has_far_grid && kernel != MolecularField::default_kernel()) continue;
      MolecularField field(a, b, model, kernel);
      const std::uint64_t before = test::allocation_count();
      const FieldResult result = field.evaluate({{22, 1, 2}, Quat::Identity()});
      EXPECT_EQ(test::allocation_count(), before) << kernel << " " << cutoff;
      EXPECT_NE(result.energy_kj_per_mol(), 0.0) << kernel << " " << cutoff;
    }
  }
}

}  // namespace
}  // namespace tandem::docking
