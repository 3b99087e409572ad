#include "lab/session/live_rows.hpp"

#include <gtest/gtest.h>

namespace tandem::lab {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr LocalTime kStart{seconds(100)};

/// Returns a user whose path has the phase "move" for 3 ms, then "hold" at 10 mm.
ExperimentUser someone() {
  devices::WayPoint move;
  move.phase = "move";
  devices::WayPoint hold;
  hold.at = milliseconds(3);
  hold.X_DH.p.x() = 0.010;
  hold.phase = "hold";
  ExperimentUser user;
  user.hand = devices::HandPath({move, hold});
  user.tick_phase = microseconds(250);
  return user;
}

/// Returns a tick at `since_start` after the start, in which the device displays `force_n`.
LiveTick tick_at(Duration since_start, double force_n) {
  LiveTick tick;
  tick.record.at = kStart + since_start;
  tick.record.displayed_on_hand_D.f.x() = force_n;
  tick.hand_D.p.x() = 0.001 * force_n;
  return tick;
}

TEST(LiveRows, EveryMillisecondHasARowAndLateTicksStayInTheirs) {
  const std::vector<LiveTick> ticks{tick_at(microseconds(100), 1), tick_at(microseconds(1990), 2),
                                    tick_at(microseconds(2010), 3), tick_at(microseconds(3100), 4)};
  std::uint64_t skipped = 0;
  const std::vector<TickSample> rows = live_rows(someone(), ticks, kStart, milliseconds(4), skipped);
  ASSERT_EQ(rows.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(rows[k].displayed_D.f.x(), 1.0 + static_cast<double>(k));
    EXPECT_EQ(rows[k].hand_D.p.x(), 0.001 * (1.0 + static_cast<double>(k)));
    EXPECT_EQ(rows[k].time, ticks[k].record.at - kStart);
  }
  EXPECT_EQ(skipped, 0U);
}

TEST(LiveRows, ASkippedMillisecondRepeatsWhatTheHandFeltAndIsCounted) {
  const std::vector<LiveTick> ticks{tick_at(microseconds(250), 1), tick_at(microseconds(3300), 2)};
  std::uint64_t skipped = 0;
  const std::vector<TickSample> rows = live_rows(someone(), ticks, kStart, milliseconds(5), skipped);
  ASSERT_EQ(rows.size(), 5U);
  EXPECT_EQ(rows[1].displayed_D.f.x(), 1);
  EXPECT_EQ(rows[2].displayed_D.f.x(), 1);
  EXPECT_EQ(rows[2].time, microseconds(2250));
  EXPECT_EQ(rows[3].displayed_D.f.x(), 2);
  EXPECT_EQ(rows[4].displayed_D.f.x(), 2);
  EXPECT_EQ(skipped, 3U);
}

TEST(LiveRows, OfTwoTicksInAMillisecondTheNewerIsTheRow) {
  const std::vector<LiveTick> ticks{tick_at(microseconds(10), 1), tick_at(microseconds(990), 2),
                                    tick_at(microseconds(1500), 3)};
  std::uint64_t skipped = 0;
  const std::vector<TickSample> rows = live_rows(someone(), ticks, kStart, milliseconds(2), skipped);
  EXPECT_EQ(rows[0].displayed_D.f.x(), 2);
  EXPECT_EQ(rows[1].displayed_D.f.x(), 3);
  EXPECT_EQ(skipped, 0U);
}

TEST(LiveRows, PhaseAndIntendedPlaceAreThePathsAtTheTimeSinceTheStart) {
  const ExperimentUser user = someone();
  const std::vector<LiveTick> ticks{tick_at(microseconds(100), 1), tick_at(microseconds(4100), 2)};
  std::uint64_t skipped = 0;
  const std::vector<TickSample> rows = live_rows(user, ticks, kStart, milliseconds(5), skipped);
  EXPECT_EQ(rows[0].phase, 0);
  EXPECT_EQ(rows[3].phase, 1) << "repeated, but the path has gone on";
  EXPECT_EQ(rows[4].phase, 1);
  EXPECT_EQ(rows[0].intended_D, user.hand.pose_at(microseconds(100)).p);
  EXPECT_EQ(rows[4].intended_D.x(), 0.010);
}

TEST(LiveRows, WithoutTicksThereAreNoRows) {
  std::uint64_t skipped = 0;
  EXPECT_TRUE(live_rows(someone(), {}, kStart, milliseconds(5), skipped).empty());
  EXPECT_EQ(skipped, 0U);
}

}  // namespace
}  // namespace tandem::lab
