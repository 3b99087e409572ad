// Compares the interface of two molecules with a loop over all pairs, and tests poses that have a given interface size.
#include "lab/studies/docking/interface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <stdexcept>
#include <string>

#include "lab/studies/docking/field_scaling.hpp"
#include "tests/support/molecules.hpp"

namespace tandem::lab {
namespace {

constexpr unsigned kSeed = 20261123;
constexpr double kReach = 8;

std::size_t atoms_in(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB) {
  return interface_facts(a, b, X_AB, kReach).at("interface_atoms").to_number<std::size_t>();
}

TEST(Interface, EqualsTheResultOfAllPairs) {
  std::mt19937 random(kSeed);
  const docking::Molecule a = test::random_molecule(700, random), b = test::random_molecule(300, random);
  for (const double offset : {0.0, 15.0, 30.0}) {
    const Pose X_AB = {Vec3(offset, 3, -2), test::random_rotation(random)};
    std::set<std::size_t> of_a, of_b;
    std::size_t pairs = 0;
    double shortest = 1e9;
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j < b.size(); ++j) {
        const double distance = (a.positions_angstrom[i] - X_AB * b.positions_angstrom[j]).norm();
        if (distance >= kReach) continue;
        of_a.insert(i);
        of_b.insert(j);
        ++pairs;
        shortest = std::min(shortest, distance);
      }
    }
    const boost::json::object facts = interface_facts(a, b, X_AB, kReach);
    ASSERT_GT(pairs, 0U) << "offset " << offset << ", seed " << kSeed;
    EXPECT_EQ(facts.at("interface_atoms").to_number<std::size_t>(), of_a.size() + of_b.size());
    EXPECT_EQ(facts.at("pairs_within").to_number<std::size_t>(), pairs);
    EXPECT_NEAR(facts.at("min_distance_angstrom").as_double(), shortest, 1e-9);
  }
  EXPECT_TRUE(interface_facts(a, b, {Vec3(500, 0, 0), Quat::Identity()}, kReach).at("min_distance_angstrom").is_null());
}

TEST(PosesByInterface, HaveAsManyAtomsAsWantedAndNoMoreThanOneStepGives) {
  std::mt19937 random(kSeed);
  const docking::Molecule a = test::random_molecule(2000, random), b = test::random_molecule(900, random);
  const std::vector<std::size_t> sizes = {50, 200, 400};
  const std::vector<Pose> poses = poses_by_interface(a, b, kReach, sizes);
  ASSERT_EQ(poses.size(), sizes.size());
  const Vec3 inwards = (poses.back().p - poses.front().p).normalized();
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    EXPECT_GE(atoms_in(a, b, poses[k]), sizes[k]);
    EXPECT_LT(atoms_in(a, b, {poses[k].p - 2e-3 * inwards, poses[k].q}), sizes[k]);
    EXPECT_LE(atoms_in(a, b, poses[k]), sizes[k] + 10);
    EXPECT_EQ(poses[k].q.coeffs(), Quat::Identity().coeffs());
  }
  // In these molecules each atom occupies a cube of 3 Å. Therefore an interface of 400 atoms exists without overlap.
  EXPECT_GT(interface_facts(a, b, poses.back(), kReach).at("min_distance_angstrom").as_double(), 1.0);
}

TEST(PosesByInterface, ThatDoNotExistAreRefusedWithTheMostThereAre) {
  const docking::Molecule atom = test::one_atom(3, 1);
  EXPECT_EQ(poses_by_interface(atom, atom, kReach, {2}).size(), 1U);
  try {
    poses_by_interface(atom, atom, kReach, {3});
    FAIL() << "two atoms made an interface of three";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("more than 2"), std::string::npos) << error.what();
  }
  EXPECT_THROW(poses_by_interface(docking::Molecule(), atom, kReach, {1}), std::invalid_argument);
}

TEST(FieldScaling, ShowsEachInterfaceInFigureAndTable) {
  boost::json::array rows;
  for (const int atoms : {100, 321}) {
    rows.push_back(boost::json::object{{"interface_atoms", atoms},
                                       {"pairs_within", 7 * atoms},
                                       {"pairs", 9 * atoms},
                                       {"min_distance_angstrom", nullptr},
                                       {"eval_us", boost::json::object{{"p50", 0.5 * atoms}, {"p99", 0.75 * atoms}}},
                                       {"share_of_limit", 0.25}});
  }
  const std::string page = field_scaling_report("8,279 x 906 atoms", rows).html();
  for (const char* const text : {"<svg", "8,279 x 906 atoms", ">321<", ">2247<", ">160.5<", ">240.8<"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace tandem::lab
