// Compares the search over two cluster trees with a search over all pairs of points. Detects missed pairs and needless
// leaves.
#include "common/docking/cluster_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "common/docking/field_kernel.hpp"
#include "tests/support/molecules.hpp"

namespace tandem::docking {
namespace {

constexpr unsigned kClusterTreeSeed = 20261123;

using Leaves = std::pair<std::uint32_t, std::uint32_t>;  ///< indices of a leaf of A and a leaf of B

std::vector<std::uint32_t> leaf_of_each_point(const ClusterTree& tree) {
  std::vector<std::uint32_t> leaves(tree.order().size());
  for (std::size_t i = 0; i < leaves.size(); ++i) leaves[tree.order()[i]] = static_cast<std::uint32_t>(i / kLanes);
  return leaves;
}

std::set<Leaves> leaves_with_a_pair(const std::vector<Vec3>& a, const std::vector<Vec3>& b, const ClusterTree& tree_a,
                                    const ClusterTree& tree_b, const Pose& X_AB, double cutoff) {
  const std::vector<std::uint32_t> leaf_a = leaf_of_each_point(tree_a), leaf_b = leaf_of_each_point(tree_b);
  std::set<Leaves> found;
  for (std::size_t j = 0; j < b.size(); ++j) {
    const Vec3 p = X_AB * b[j];
    for (std::size_t i = 0; i < a.size(); ++i) {
      if ((a[i] - p).squaredNorm() < cutoff * cutoff) found.insert({leaf_a[i], leaf_b[j]});
    }
  }
  return found;
}

/// Parameter of the fixture: true if the two molecules are exchanged, so that the larger one is B.
class NeighbourSearches : public testing::TestWithParam<bool> {};

TEST_P(NeighbourSearches, FindAllLeavesWithAPairAndFewOthers) {
  std::mt19937 random(kClusterTreeSeed);
  std::uniform_real_distribution<double> offset(-45, 45);
  std::vector<Vec3> a = test::random_molecule(1500, random).positions_angstrom;
  std::vector<Vec3> b = test::random_molecule(333, random).positions_angstrom;
  if (GetParam()) std::swap(a, b);
  const ClusterTree tree_a(a), tree_b(b);
  ASSERT_NE(tree_a.levels().size(), tree_b.levels().size());
  NeighbourSearch search(tree_a, tree_b, near_children_portable);
  std::size_t needed_in_all = 0, found_in_all = 0;
  for (int pose = 0; pose < 40; ++pose) {
    const Pose X_AB = {Vec3(offset(random), offset(random), offset(random)), test::random_rotation(random)};
    const double cutoff = pose % 2 == 0 ? 8 : 14;
    const std::set<Leaves> needed = leaves_with_a_pair(a, b, tree_a, tree_b, X_AB, cutoff);
    std::set<Leaves> found;
    std::size_t count = 0;
    search.run(X_AB, cutoff, [&](std::uint32_t leaf_b, std::span<const std::uint32_t> near) {
      count += near.size();
      for (const std::uint32_t leaf_a : near) found.insert({leaf_a, leaf_b});
    });
    EXPECT_EQ(count, found.size()) << "a pair of leaves was found twice, pose " << pose << ", seed "
                                   << kClusterTreeSeed;
    EXPECT_TRUE(std::includes(found.begin(), found.end(), needed.begin(), needed.end()))
        << pose << " " << kClusterTreeSeed;
    needed_in_all += needed.size();
    found_in_all += found.size();
  }
  EXPECT_GT(needed_in_all, 1000U);
  EXPECT_LT(found_in_all, 3 * needed_in_all);
}

INSTANTIATE_TEST_SUITE_P(ClusterTree, NeighbourSearches, testing::Bool());

TEST(NeighbourSearch, FindsNothingWithoutPoints) {
  const std::vector<Vec3> point = {Vec3(1, 2, 3)};
  const ClusterTree none({}), one(point);
  for (const auto& [a, b] : {std::pair(&none, &one), std::pair(&one, &none), std::pair(&none, &none)}) {
    NeighbourSearch search(*a, *b, near_children_portable);
    search.run({}, 8, [](std::uint32_t, std::span<const std::uint32_t>) { ADD_FAILURE(); });
  }
}

TEST(ClusterTree, BoxesHoldTheirPointsAndLeavesAllOfThem) {
  std::mt19937 random(kClusterTreeSeed);
  for (const std::size_t count : {1UL, 16UL, 17UL, 500UL, 1030UL}) {
    const std::vector<Vec3> points = test::random_molecule(count, random).positions_angstrom;
    const ClusterTree tree(points);
    std::vector<std::uint32_t> order = tree.order();
    std::size_t atoms = kLanes;
    for (std::size_t level = 0; level < tree.levels().size(); ++level, atoms *= kChildren) {
      EXPECT_EQ(tree.child_count(level), (count + atoms - 1) / atoms);
      for (std::size_t i = 0; i < count; ++i) {
        const ChildBoxes& boxes = tree.levels()[level][i / atoms / kChildren];
        EXPECT_TRUE(child_box(boxes, i / atoms % kChildren).contains(points[order[i]])) << level << ", point " << i;
      }
    }
    EXPECT_EQ(tree.levels().back().size(), 1U);
    std::sort(order.begin(), order.end());
    for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(order[i], i);
  }
}

}  // namespace
}  // namespace tandem::docking
