// Tests joining over a link that carries states and assets, in virtual time.
#include <gtest/gtest.h>

#include <array>

#include "lab/experiment/experiment_library.hpp"
#include "lab/session/join_trial.hpp"

namespace tandem::lab {
namespace {

Experiment bunny_over(double mbit_per_s, Duration round_trip) {
  const std::array<std::string, 1> names{"bunny"};
  Experiment experiment = load_experiment(experiment_files(names).front());
  experiment.duration = from_seconds(6);
  for (ExperimentUser& user : experiment.users) {
    user.up.delay = user.down.delay = round_trip / 2;
    user.up.rate_limit_bytes_per_s = user.down.rate_limit_bytes_per_s = mbit_per_s * 1e6 / 8;
  }
  return experiment;
}

TEST(Join, FetchingAheadLeavesStateAloneAndFetchingInTurnDoesNot) {
  const Experiment experiment = bunny_over(10, std::chrono::milliseconds(50));
  const auto ways = measure_join(experiment, load_experiment_scene(experiment));
  ASSERT_EQ(ways.size(), 3U);
  const JoinFigures &here = ways[0], &fetched = ways[1], &in_turn = ways[2];
  EXPECT_LE(here.wait_max_ms, 1);
  EXPECT_GT(in_turn.wait_p99_ms, 30) << "a chunk of 64 KiB occupies the link for 52 ms";
  EXPECT_LE(fetched.wait_p99_ms, 5);
  EXPECT_LE(fetched.wait_max_ms, 12);
  EXPECT_GT(fetched.states_per_s, 0.98 * here.states_per_s);
  ASSERT_TRUE(fetched.full_local_after_s && in_turn.full_local_after_s);
  EXPECT_LT(*fetched.full_local_after_s, 1.2 * *in_turn.full_local_after_s);
  EXPECT_LT(fetched.stream_bytes, 4e6);
}

TEST(Join, TouchesByCoarseAssetsWithinASecondAndByTheWholeOnesWithinSix) {
  for (const int round_trip_ms : {100, 200}) {
    const Experiment experiment = bunny_over(10, std::chrono::milliseconds(round_trip_ms));
    const JoinFigures join = measure_join(experiment, load_experiment_scene(experiment))[1];
    SCOPED_TRACE(round_trip_ms);
    ASSERT_TRUE(join.local_after_s && join.full_local_after_s);
    const double more_s = round_trip_ms == 200 ? 0.5 : 0;
    EXPECT_LE(*join.local_after_s, 1 + more_s);
    EXPECT_LE(*join.full_local_after_s, 6 + more_s);
    EXPECT_LT(*join.local_after_s, *join.full_local_after_s);
    EXPECT_LE(join.stream_bytes, 4e6);
    EXPECT_LE(join.wait_p99_ms, 5);
    EXPECT_LE(join.wait_max_ms, 20);
    ASSERT_GT(join.coarse_ticks, 200U) << "no contact with the coarse assets";
    EXPECT_LE(join.coarse_force_share, 0.2);
    EXPECT_LE(join.coarse_mm, 2);
    ASSERT_GT(join.going_over_n, 0.5) << "no contact when the whole assets replaced them";
    EXPECT_LE(join.step_n, join.usual_step_n + 0.1);
  }
}

}  // namespace
}  // namespace tandem::lab
