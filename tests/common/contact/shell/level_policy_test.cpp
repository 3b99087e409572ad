// Tests the transitions between levels, as in the figure of common/contact/SEARCH.md, with given loads and without a
// shape. A level limits how many points a node of the search tree may have if it is treated as a leaf. The cut is the
// set of nodes that the search stores between steps; a walk is one traversal of the cut.
#include "common/contact/shell/level_policy.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace tandem::contact {
namespace {

constexpr std::uint32_t kRoomForContacts = 100;
constexpr std::size_t kRoomForCut = 1000;
/// Number of points of the largest part (subtree in which the cut lies). At level 7, a pressing leaf may have
/// 8 × 2^(7 − 4) = 64 points, so a part is one leaf, and no coarser level is needed.
constexpr std::uint32_t kMostPoints = 64;
constexpr int kCoarsest = 7;
constexpr double kNarrow_m = 1e-4, kUsual_m = 5e-4, kWide_m = 2e-3;
constexpr std::uint32_t kQueriesOfAStep = 130;  ///< limit of queries of a usual walk: 1.3 for each of kRoomForContacts

/// Load with few near points, within all limits.
constexpr SearchLoad kLittle{.near_count = 10, .contacts = 10, .cut_size = 100, .walk_points = 20, .band_m = kUsual_m};
/// Load with more near points than the capacity. The finest level must not be tried.
constexpr SearchLoad kMuchNear{
    .near_count = 200, .contacts = 30, .cut_size = 100, .walk_points = 60, .band_m = kUsual_m};

LevelPolicy bound() {
  LevelPolicy policy;
  policy.bind(kRoomForContacts, kRoomForCut, kMostPoints);
  policy.begin_step();
  return policy;
}

/// Returns a policy at the level `level`, after the search has built its first cut.
LevelPolicy at_level(int level) {
  LevelPolicy policy = bound();
  policy.set_level(level);
  policy.end_first_cut();
  return policy;
}

void take_steps(LevelPolicy& policy, int steps) {
  for (int i = 0; i < steps; ++i) policy.begin_step();
}

/// Returns the number of steps until a finer level is tried; −1 if it takes more than 3,000 steps.
int steps_to_trial(LevelPolicy policy, const SearchLoad& load) {
  for (int steps = 0; steps < 3000; ++steps, policy.begin_step()) {
    if (policy.may_be_finer(load, false)) return steps;
  }
  return -1;
}

TEST(LevelPolicy, AFirstCutIsFineUnlessItHasNoRoom) {
  LevelPolicy policy = bound();
  EXPECT_EQ(policy.phase(), SearchPhase::kFirstCut);
  EXPECT_EQ(policy.walk_queries(kUsual_m), 16 * kQueriesOfAStep);
  EXPECT_FALSE(policy.may_be_finer(kLittle, false));
  EXPECT_EQ(policy.queries_to_divide(kLittle), 0U);
  policy.end_first_cut();
  EXPECT_EQ(policy.phase(), SearchPhase::kFine);
  EXPECT_EQ(at_level(1).phase(), SearchPhase::kCoarse);
}

TEST(LevelPolicy, AnExceededBudgetSelectsALevelThatSavesEnough) {
  const SearchLoad contacts{.contacts = kRoomForContacts + 1, .band_m = kUsual_m};
  const SearchLoad queries{.contacts = kRoomForContacts, .band_m = kUsual_m};
  EXPECT_EQ(at_level(LevelPolicy::kFineLevel).next_coarser_level(contacts), 0);
  EXPECT_EQ(at_level(LevelPolicy::kFineLevel).next_coarser_level(queries), 1);
  EXPECT_EQ(at_level(0).next_coarser_level(contacts), 1);
  EXPECT_EQ(at_level(1).next_coarser_level(contacts), 3);
  EXPECT_EQ(at_level(6).next_coarser_level(contacts), kCoarsest);
}

TEST(LevelPolicy, LevelsThatActAsLevel0InANarrowBandAreSkipped) {
  const SearchLoad queries{.contacts = kRoomForContacts, .band_m = kNarrow_m};
  EXPECT_EQ(at_level(LevelPolicy::kFineLevel).next_coarser_level(queries), 5);
  EXPECT_EQ(at_level(0).next_coarser_level(queries), 5);
  SearchLoad near = kMuchNear;
  EXPECT_EQ(at_level(5).finer_level(near), 4);
  near.band_m = kNarrow_m;
  EXPECT_EQ(at_level(5).finer_level(near), 0);
  EXPECT_EQ(at_level(3).finer_level(near), LevelPolicy::kFineLevel);
}

TEST(LevelPolicy, LeavesAreSmallerWhereTheyMayPress) {
  const LevelPolicy policy = at_level(6);
  EXPECT_EQ(policy.leaf_points(1e-2), 8U << 6U);
  EXPECT_EQ(policy.leaf_points(1e-4), 8U << 2U);
  EXPECT_EQ(at_level(3).leaf_points(1e-4), 8U);
  EXPECT_EQ(at_level(LevelPolicy::kFineLevel).leaf_points(1e-2), 0U);
}

TEST(LevelPolicy, GetsCoarserAfterFiveDenseStepsInARow) {
  SearchLoad dense = kMuchNear;
  dense.walk_points = kQueriesOfAStep + 1;
  LevelPolicy policy = at_level(1);
  for (int i = 0; i < 4; ++i) policy.note_load(dense);
  EXPECT_FALSE(policy.is_too_dense());
  policy.note_load(kLittle);
  for (int i = 0; i < 4; ++i) policy.note_load(dense);
  EXPECT_FALSE(policy.is_too_dense()) << "a step in between was not dense";
  policy.note_load(dense);
  EXPECT_TRUE(policy.is_too_dense());
  policy.set_level(3);
  EXPECT_FALSE(policy.is_too_dense()) << "a new level begins without dense steps";
}

TEST(LevelPolicy, AllowsMoreQueriesWhereFewPointsAreNear) {
  const auto is_dense = [](int level, double factor) {
    SearchLoad load = kLittle;
    load.walk_points = static_cast<std::uint32_t>(factor * kQueriesOfAStep) + 1;
    LevelPolicy policy = at_level(level);
    for (int i = 0; i < 5; ++i) policy.note_load(load);
    return policy.is_too_dense();
  };
  EXPECT_FALSE(is_dense(LevelPolicy::kFineLevel, 1.2));
  EXPECT_TRUE(is_dense(LevelPolicy::kFineLevel, 1.3)) << "the next level is as fine where points may press";
  EXPECT_FALSE(is_dense(4, 1.9));
  EXPECT_TRUE(is_dense(4, 2.0));
  EXPECT_FALSE(is_dense(kCoarsest, 10)) << "there is no coarser level";
}

TEST(LevelPolicy, TriesAFinerLevelAfter64StepsOr16WhereFewPointsAreNear) {
  LevelPolicy policy = at_level(3);
  policy.postpone_trial();
  EXPECT_EQ(steps_to_trial(policy, kMuchNear), 64);
  EXPECT_EQ(steps_to_trial(policy, kLittle), 16);
  EXPECT_FALSE(policy.may_be_finer(kLittle, true)) << "not while nodes are divided";
  SearchLoad full = kMuchNear;
  full.contacts = 41;
  EXPECT_EQ(steps_to_trial(policy, full), -1) << "a finer level may need twice the contacts";
  EXPECT_EQ(policy.finer_level(kMuchNear), 2);
  EXPECT_EQ(policy.finer_level(kLittle), LevelPolicy::kFineLevel);
}

TEST(LevelPolicy, ATrialHasTheQueriesOfAUsualWalk) {
  LevelPolicy policy = at_level(3);
  policy.set_level(2);
  EXPECT_EQ(policy.walk_queries(kUsual_m), 8 * kQueriesOfAStep);
  EXPECT_EQ(policy.walk_queries(kWide_m), 16 * kQueriesOfAStep);
  policy.begin_trial();
  EXPECT_EQ(policy.phase(), SearchPhase::kTrial);
  EXPECT_EQ(policy.walk_queries(kUsual_m), 4 * kQueriesOfAStep);
}

TEST(LevelPolicy, AFailedTrialReturnsAndDoublesTheInterval) {
  LevelPolicy policy = at_level(3);
  take_steps(policy, 100);
  int interval = 64;
  for (int i = 0; i < 6; ++i) {
    const LevelPolicy before = policy;
    policy.set_level(2);
    policy.begin_trial();
    policy.fail_trial();
    policy.restore(before, false);
    interval = std::min(2 * interval, 1024);
    EXPECT_EQ(policy.level(), 3);
    EXPECT_EQ(policy.phase(), SearchPhase::kCoarse);
    EXPECT_FALSE(policy.is_new_level());
    EXPECT_EQ(steps_to_trial(policy, kMuchNear), interval);
    EXPECT_EQ(steps_to_trial(policy, kLittle), interval) << "after a failure, also with few near points";
    take_steps(policy, interval);
  }
}

TEST(LevelPolicy, ATrialThatDidNotLastDoublesTheInterval) {
  const auto interval_after = [](int steps) {
    LevelPolicy policy = at_level(3);
    policy.set_level(2);
    policy.begin_trial();
    take_steps(policy, steps);
    policy.postpone_trial();
    return steps_to_trial(policy, kMuchNear);
  };
  EXPECT_EQ(interval_after(10), 128);
  EXPECT_EQ(interval_after(100), 64);
}

TEST(LevelPolicy, DividesAfterFourStepsWhileThereIsRoom) {
  LevelPolicy policy = at_level(3);
  policy.set_level(3);
  take_steps(policy, 3);
  EXPECT_EQ(policy.queries_to_divide(kLittle), 0U);
  take_steps(policy, 1);
  EXPECT_EQ(policy.queries_to_divide(kLittle), kQueriesOfAStep - 2 * kLittle.walk_points);
  SearchLoad load = kLittle;
  load.contacts = 41;
  EXPECT_EQ(policy.queries_to_divide(load), 0U) << "contacts";
  load = kLittle;
  load.cut_size = 451;
  EXPECT_EQ(policy.queries_to_divide(load), 0U) << "cut";
  load = kLittle;
  load.walk_points = 65;
  EXPECT_EQ(policy.queries_to_divide(load), 0U) << "queries";
}

TEST(LevelPolicy, DividedNodesAreJoinedBeforeALevelGetsCoarser) {
  LevelPolicy policy = at_level(3);
  policy.set_level(3);
  const auto steps_to_divide = [](LevelPolicy copy) {
    for (int steps = 0;; ++steps, copy.begin_step()) {
      if (copy.queries_to_divide(kLittle) > 0) return steps;
    }
  };
  int interval = 4;
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(steps_to_divide(policy), interval);
    policy.note_divided();
    EXPECT_EQ(policy.phase(), SearchPhase::kDividing);
    const int level = policy.next_coarser_level(kMuchNear);
    EXPECT_EQ(level, 3);
    policy.set_level(level);
    EXPECT_EQ(policy.phase(), SearchPhase::kCoarse);
    interval = std::min(2 * interval, 1024);
  }
  EXPECT_EQ(policy.next_coarser_level(kMuchNear), 5) << "outside of the division phase, the next coarser level is used";
  policy.set_level(5);
  EXPECT_EQ(steps_to_divide(policy), 4);
}

TEST(LevelPolicy, AtTheCoarsestLevelPairsAreJoinedFirstWhereQueriesAreTooMany) {
  LevelPolicy policy = at_level(kCoarsest);
  EXPECT_TRUE(policy.is_coarsest());
  policy.note_divided();
  EXPECT_FALSE(policy.is_coarsest());
  EXPECT_FALSE(policy.joins_pairs_first());
  SearchLoad dense = kMuchNear;
  dense.walk_points = 3 * kQueriesOfAStep;
  for (int i = 0; i < 5; ++i) policy.note_load(dense);
  EXPECT_TRUE(policy.joins_pairs_first());
}

TEST(LevelPolicy, ADividedTrialStillCountsAsATrial) {
  LevelPolicy policy = at_level(3);
  policy.set_level(2);
  policy.begin_trial();
  take_steps(policy, 10);
  policy.note_divided();
  EXPECT_EQ(policy.phase(), SearchPhase::kDividing);
  policy.postpone_trial();
  EXPECT_EQ(steps_to_trial(policy, kMuchNear), 128);
  policy.set_level(2);
  policy.note_divided();
  policy.postpone_trial();
  EXPECT_EQ(steps_to_trial(policy, kMuchNear), 128) << "after an overflow by dividing the interval stays";
}

TEST(LevelPolicy, AfterAFailedTrialTheNextBeginsWhenAllNodesAreDivided) {
  LevelPolicy policy = at_level(3);
  take_steps(policy, 5);
  policy.note_divided();
  const LevelPolicy before = policy;
  policy.set_level(2);
  policy.begin_trial();
  policy.fail_trial();
  policy.restore(before, true);
  EXPECT_EQ(policy.phase(), SearchPhase::kDividing) << "the level before was divided";
  EXPECT_EQ(steps_to_trial(policy, kMuchNear), 128);
  policy.end_dividing();
  EXPECT_EQ(steps_to_trial(policy, kMuchNear), 0);
}

TEST(LevelPolicy, JoinsFarNodesOfAFullCutEvery100Steps) {
  LevelPolicy policy = at_level(3);
  policy.set_level(3);
  take_steps(policy, 100);
  EXPECT_FALSE(policy.begins_to_join_far(451));
  take_steps(policy, 1);
  EXPECT_FALSE(policy.begins_to_join_far(450));
  EXPECT_TRUE(policy.begins_to_join_far(451));
  EXPECT_FALSE(policy.begins_to_join_far(451));
  take_steps(policy, 101);
  EXPECT_TRUE(policy.begins_to_join_far(451));
  policy.set_level(LevelPolicy::kFineLevel);
  take_steps(policy, 200);
  EXPECT_FALSE(policy.begins_to_join_far(451)) << "a fine level has no nodes to join";
}

TEST(LevelPolicy, PlaneQueriesAreLimitedByTheAgeOfTheLevel) {
  LevelPolicy policy = bound();
  EXPECT_EQ(policy.plane_queries(kUsual_m), 50'000U);
  policy.end_first_cut();
  EXPECT_EQ(policy.plane_queries(kUsual_m), 2500U);
  policy.begin_step();
  EXPECT_EQ(policy.plane_queries(kUsual_m), 400U);
  EXPECT_EQ(policy.plane_queries(kWide_m), 50'000U);
}

}  // namespace
}  // namespace tandem::contact
