// Joining over a line that state and assets share, in virtual time.
#include <gtest/gtest.h>

#include <array>

#include "lab/experiment/experiment_library.hpp"
#include "lab/session/join_trial.hpp"

namespace tandem::lab {
namespace {

Experiment bunny_over(double mbit_per_s) {
  const std::array<std::string, 1> names{"bunny"};
  Experiment experiment = load_experiment(experiment_files(names).front());
  experiment.duration = from_seconds(6);
  for (ExperimentUser& user : experiment.users) {
    user.up.delay = user.down.delay = std::chrono::milliseconds(25);
    user.up.rate_limit_bytes_per_s = user.down.rate_limit_bytes_per_s = mbit_per_s * 1e6 / 8;
  }
  return experiment;
}

TEST(Join, FetchingAheadLeavesStateAloneAndFetchingInTurnDoesNot) {
  const Experiment experiment = bunny_over(10);
  const auto ways = measure_join(experiment, load_experiment_scene(experiment));
  ASSERT_EQ(ways.size(), 3U);
  const JoinFigures &here = ways[0], &fetched = ways[1], &in_turn = ways[2];
  EXPECT_LE(here.wait_max_ms, 1);
  EXPECT_GT(in_turn.wait_p99_ms, 30) << "a chunk of 64 KiB takes 52 ms of the line";
  EXPECT_LE(fetched.wait_p99_ms, 5);
  EXPECT_LE(fetched.wait_max_ms, 12);
  EXPECT_GT(fetched.states_per_s, 0.98 * here.states_per_s);
  ASSERT_TRUE(fetched.local_after_s && in_turn.local_after_s);
  EXPECT_LT(*fetched.local_after_s, 1.2 * *in_turn.local_after_s);
  EXPECT_LT(fetched.stream_bytes, 4e6);
}

}  // namespace
}  // namespace tandem::lab
