// Tests which threads get real-time priority: io first, then rooms by ascending load, up to the limit of the kernel.
#include "server/net/realtime_share.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace tandem::server {
namespace {

using testing::ElementsAre;

/// Returns which threads have real-time priority after one call of share_realtime() with two cores. Before the call,
/// either all threads have priority (`had_priority`) or none.
std::vector<bool> shared(const std::vector<double>& demands, bool had_priority = true) {
  std::vector<bool> have(demands.size(), had_priority);
  share_realtime(demands, have, 2);
  return have;
}

TEST(RealtimeShare, ATooLargeRoomLosesItsPriorityAndTheDelayedOnesKeepIt) {
  EXPECT_THAT(shared({0.3, 5.0, 0.35, 0.35, 0.35}), ElementsAre(true, false, true, true, true));
}

TEST(RealtimeShare, ARoomThatNeedsNearlyAWholeCoreGoesEvenAlone) {
  EXPECT_THAT(shared({0.1, 0.94}), ElementsAre(true, false));
  EXPECT_THAT(shared({0.1, 0.92}), ElementsAre(true, true));
}

TEST(RealtimeShare, OfTooManyRoomsTheLargestGoUntilTheOthersFit) {
  EXPECT_THAT(shared({0.4, 0.6, 0.5, 0.4, 0.3}), ElementsAre(true, false, true, true, true));
}

TEST(RealtimeShare, IoHasPriorityAtAnyLoad) {
  EXPECT_THAT(shared({1.5, 0.5}), ElementsAre(true, false));
}

TEST(RealtimeShare, ARoomThatJustFitsKeepsItsPriorityButDoesNotGainIt) {
  EXPECT_THAT(shared({0, 0.9}, true), ElementsAre(true, true));
  EXPECT_THAT(shared({0, 0.9}, false), ElementsAre(true, false));
  EXPECT_THAT(shared({0, 0.84}, false), ElementsAre(true, true));
  EXPECT_THAT(shared({0, 0.84, 0.84}, false), ElementsAre(true, true, true));
  EXPECT_THAT(shared({0.1, 0.84, 0.84}, false), ElementsAre(true, true, false));
}

}  // namespace
}  // namespace tandem::server
