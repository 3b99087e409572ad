// Tests the cut: the set of tree nodes that the search stores from step to step. After a motion, the stored cut must be
// as fine and as small as a newly built cut. A coarser cut would miss contacts; a larger one would cost more with each
// step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "common/contact/contact_pair.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "common/contact/points/flat_node.hpp"
#include "tests/common/contact/hand_made_shell.hpp"

namespace tandem::contact {
namespace {

constexpr double kShellCutBand_m = 1e-4;

/// A table whose distance field reports no planes in a strip of 6 mm around x = 0.
class LinedTable final : public DistanceField {
 public:
  explicit LinedTable(const Vec3& size_m) : table_(box_field(size_m)) {}
  double distance_m(const Vec3& p_S) const noexcept override { return table_->distance_m(p_S); }
  DistanceSample sample(const Vec3& p_S) const noexcept override { return table_->sample(p_S); }
  std::span<const FieldPlane> planes() const noexcept override { return table_->planes(); }
  PlaneSet planes_over(const OrientedBox& box_S, std::size_t& queries) const noexcept override {
    queried.push_back(box_S.centre);
    return std::abs(box_S.centre.x()) < box_S.reach_m(Vec3::UnitX()) + 3e-3 ? 0 : table_->planes_over(box_S, queries);
  }
  double error_m() const noexcept override { return table_->error_m(); }
  double band_m() const noexcept override { return table_->band_m(); }

  mutable std::vector<Vec3> queried;  ///< centres of the queried boxes

 private:
  std::shared_ptr<const DistanceField> table_;
};

TEST(ShellCut, AFaceIsOneAgainWhereALineWasPassed) {
  const Vec3 table_m(0.4, 0.1, 0.02);
  const ContactShape block = box_shape(Vec3(0.02, 0.02, 0.02));
  ContactShape table = box_shape(table_m, 4e-3);
  table.field = std::make_shared<LinedTable>(table_m);
  // If the block is not tilted, up to eight points share one contact. If it is tilted, each point is a contact.
  for (const double tilt_rad : {0.0, 2e-3}) {
    const auto at = [&](double x_m) { return Pose{Vec3(x_m, 0, 0.02 - 2e-5), quaternion_of(Vec3(tilt_rad, 0, 0))}; };
    ContactPair pair(2048);
    pair.bind(&block, &table);
    pair.find(at(-0.05), {}, kShellCutBand_m);
    const std::size_t of_a_face = pair.contacts().size();
    std::size_t most = 0, most_points = 0, last = 0, points = 0;
    for (double x_m = -0.05; x_m < 0.05; x_m += 1e-4) {
      points = pair.find(at(x_m), {}, kShellCutBand_m).points;
      last = pair.contacts().size();
      most = std::max(most, last);
      most_points = std::max(most_points, points);
    }
    EXPECT_GT(most_points, 500U) << "on the line it is points";
    EXPECT_LE(4 * last, 5 * of_a_face);
    if (tilt_rad == 0) {
      EXPECT_EQ(points, 0U);
    } else {
      EXPECT_GT(most, 2 * of_a_face) << "on the line it is many";
    }
  }
}

TEST(ShellCut, ANodeIsAskedForPlanesOnceInAStepThatTriesSeveralLevels) {
  const Vec3 table_m(0.4, 0.1, 0.02);
  const ContactShape block = box_shape(Vec3(0.016, 0.016, 0.016));
  ContactShape table = box_shape(table_m, 4e-3);
  const auto field = std::make_shared<LinedTable>(table_m);
  table.field = field;
  ContactPair pair(64);
  pair.bind(&block, &table);
  ASSERT_TRUE(pair.find({Vec3(0, 0, 0.018 - 1e-5), Quat::Identity()}, {}, kShellCutBand_m).is_coarse);
  std::vector<Vec3>& queried = field->queried;
  std::ranges::sort(queried, [](const Vec3& a, const Vec3& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  EXPECT_GT(queried.size(), 10U);
  EXPECT_EQ(std::ranges::adjacent_find(queried), queried.end());
}

TEST(ShellCut, PlanesFartherThanTheBandAreNoContacts) {
  const ContactShape block = box_shape(Vec3(0.02, 0.02, 0.02));
  const ContactShape table = box_shape(Vec3(0.4, 0.1, 0.02), 4e-3);
  const auto at = [](double gap_m) { return Pose{Vec3(0, 0, 0.02 + gap_m), Quat::Identity()}; };
  ContactPair pair;
  pair.bind(&block, &table);
  pair.find(at(1.3e-3), {}, kShellCutBand_m);
  EXPECT_TRUE(pair.contacts().empty());
  EXPECT_FALSE(pair.find(at(1.29e-3), {}, kShellCutBand_m).is_refreshed) << "until the gap is used up";
  pair.find(at(-1e-5), {}, kShellCutBand_m);
  EXPECT_FALSE(pair.contacts().empty());
}

// Squares of points lie across the edge of a table, so each square is above two planes of the table. Neighbouring
// squares have different heights. The budget suffices for the contacts with one plane per square only. No square may be
// left without a contact.
TEST(ShellCut, NodesAboveSeveralPlanesFitWhereEachHasRoomForOne) {
  constexpr int kSquares = 24;
  const Vec3 table_m(0.02, 0.4, 0.02);
  std::vector<ShellPoint> points;
  for (int square = 0; square < kSquares; ++square) {
    for (int i = 0; i < 64; ++i) {
      const int row = i / 8;
      points.push_back({Eigen::Vector3f(4e-4F * (static_cast<float>(i % 8) - 3.5F),
                                        5e-3F * static_cast<float>(square) + 4e-4F * static_cast<float>(row),
                                        square % 2 == 0 ? -5e-3F : -4.98e-3F),
                        -Eigen::Vector3f::UnitZ(), 1.6e-7F});
    }
  }
  const ContactShape squares =
      hand_made_shape(box_field(Vec3::Constant(1e-3)), PointShell::make(std::move(points), 4.5e-4));
  const ContactShape table = box_shape(table_m, 4e-3);
  ContactPair pair(460);
  pair.bind(&squares, &table);
  const Pose X_WA{Vec3(0.01, -0.1, 0.015 - 4e-5), Quat::Identity()};
  EXPECT_FALSE(pair.find(X_WA, {}, kShellCutBand_m).is_coarse);
  EXPECT_LE(pair.contacts().size(), 460U);
  double area_m2 = 0;
  for (const ContactPoint& contact : pair.contacts()) area_m2 += contact.depth_m > 0 ? contact.area_m2 : 0;
  EXPECT_NEAR(area_m2, kSquares * 32 * 1.6e-7, 0.02 * kSquares * 32 * 1.6e-7) << "half of each";
}

TEST(ShellCut, IsFineSoonAfterAHardLanding) {
  const ContactShape block = without_flat_parts(box_shape(Vec3(0.04, 0.04, 0.04)));
  const ContactShape table = box_shape(Vec3(0.4, 0.1, 0.02), 4e-3);
  for (const bool does_move : {true, false}) {
    ContactPair pair(512);
    pair.bind(&block, &table);
    const auto tilted = [](double tilt_rad, int i) {
      return Pose{Vec3(1e-6 * i, 0, 0.03 + 0.02 * std::sin(tilt_rad) - 1e-5), quaternion_of(Vec3(0, tilt_rad, 0))};
    };
    for (int i = 0; i < 40; ++i) {
      ASSERT_TRUE(pair.find(tilted(1e-4, i), {}, 5e-4).is_coarse) << "a face of 8,000 points";
    }
    bool is_coarse = true;
    for (int i = 0; i < 20; ++i) is_coarse = pair.find(tilted(0.1, does_move ? i : 0), {}, kShellCutBand_m).is_coarse;
    EXPECT_FALSE(is_coarse) << "an edge of some dozen; moves: " << does_move;
  }
}

TEST(ShellCut, APointThatNoSampleStoodForIsFound) {
  // The whole face is in contact, so the search samples only some points of a large node. Then the block is tilted onto
  // a corner. The point of this corner must be found, even if it was not among the sampled points.
  const ContactShape block = without_flat_parts(box_shape(Vec3(0.04, 0.04, 0.04)));
  const ContactShape table = box_shape(Vec3(0.4, 0.1, 0.02), 4e-3);
  ContactPair pair(64), all(40'000);
  pair.bind(&block, &table);
  all.bind(&block, &table);
  for (int i = 0; i < 40; ++i) pair.find({Vec3(0, 0, 0.03 - 1e-4), Quat::Identity()}, {}, 5e-4);
  // The block is rotated so that one of its corners is lowest.
  const Quat q = quaternion_of(Vec3(0.35, -0.25, 0));
  double lowest_m = 0;
  for (const ShellPoint& point : block.shells.surface.points) {
    lowest_m = std::min(lowest_m, (q * point.p_S.cast<double>()).z());
  }
  for (int i = 0; i < 20; ++i) pair.find({Vec3(1e-6 * i, 0, 0.01 - lowest_m - 1e-5), q}, {}, kShellCutBand_m);
  all.find({Vec3(19e-6, 0, 0.01 - lowest_m - 1e-5), q}, {}, kShellCutBand_m);
  ASSERT_FALSE(all.contacts().empty());
  double deepest_m = -1, deepest_of_all_m = -1;
  for (const ContactPoint& contact : pair.contacts()) deepest_m = std::max(deepest_m, contact.depth_m);
  for (const ContactPoint& contact : all.contacts()) deepest_of_all_m = std::max(deepest_of_all_m, contact.depth_m);
  EXPECT_DOUBLE_EQ(deepest_m, deepest_of_all_m);
}

TEST(ShellCut, PointsJustBeyondTheBandCostNoMoreThanThereIsTimeFor) {
  const ContactShape block = without_flat_parts(box_shape(Vec3(0.04, 0.04, 0.04)));
  const ContactShape table = box_shape(Vec3(0.4, 0.1, 0.02), 4e-3);
  ContactPair pair(64);
  pair.bind(&block, &table);
  std::uint32_t most = 0;
  for (int i = 0; i < 40; ++i) {
    const double gap_m = i % 2 == 0 ? 1.5e-4 : 4e-4;
    most = std::max(most, pair.find({Vec3(0, 0, 0.03 + gap_m), Quat::Identity()}, {}, kShellCutBand_m).queries());
    EXPECT_TRUE(pair.contacts().empty());
  }
  EXPECT_LT(most, 6'000U) << "of some 8,000 points on each of six sides";
}

TEST(ShellCut, FindsTheSameWhenTheBandShrinksAndGrows) {
  const ContactShape ball = hand_made_shape(sphere_field(0.01), PointShell::make(sphere_points(0.01, 6000), 4.5e-4));
  const ContactShape table = without_flat_parts(box_shape(Vec3(0.1, 0.1, 0.02), 4e-3));
  ContactPair kept(8192), fresh(8192);
  kept.bind(&ball, &table);
  for (int i = 0; i < 600; ++i) {
    const double band_m = 2e-5 * std::pow(50.0, 0.5 + 0.5 * std::sin(0.37 * i) * std::cos(0.011 * i));
    const Pose X_WA{Vec3(1e-5 * i, 0, 0.0201 + 2e-4 * std::sin(0.05 * i)), quaternion_of(Vec3(0, 1e-3 * i, 0))};
    kept.find(X_WA, {}, band_m);
    fresh.bind(&ball, &table);
    fresh.find(X_WA, {}, band_m);
    ASSERT_EQ(kept.contacts().size(), fresh.contacts().size()) << i;
  }
}

TEST(ShellCut, PosesAtTheEndOfNumbersHaveNoContacts) {
  const ContactShape block = box_shape(Vec3(0.02, 0.02, 0.02));
  const ContactShape table = box_shape(Vec3(0.4, 0.1, 0.02), 4e-3);
  ContactPair pair;
  pair.bind(&block, &table);
  pair.find({Vec3(1e308, 0, 0), Quat::Identity()}, {Vec3(-1e308, 0, 0), Quat::Identity()}, kShellCutBand_m);
  EXPECT_TRUE(pair.contacts().empty());
  pair.find({Vec3(0, 0, 0.02 - 1e-5), Quat::Identity()}, {}, kShellCutBand_m);
  EXPECT_FALSE(pair.contacts().empty());
}

}  // namespace
}  // namespace tandem::contact
