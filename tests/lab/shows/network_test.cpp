// Tests the effect of a limited data rate and of lost datagrams on the default stage.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/results/study_results.hpp"
#include "lab/results/trial_runner.hpp"
#include "tests/lab/shows/deadband.hpp"
#include "tests/lab/shows/loss_burst.hpp"
#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {
namespace {

TEST(Deadband, OfATenthLeavesOut85PercentOfTheDatagramsAndNotTheForceOfTheWall) {
  expect_few_datagrams("wall");
}

TEST(Deadband, DoesNotDivergeOnTheWallWhenATenthIsLost) {
  expect_no_divergence("wall");
}

TEST(LossBurst, TheForceDecaysAndRecoversWithoutAStep) {
  expect_recovery_from_bursts(false);
}

/// Returns the results as `tandem-lab run` writes them.
std::string results_text(const std::string& folder, std::size_t threads) {
  RunSettings settings;
  settings.out = std::filesystem::path(testing::TempDir()) / folder;
  settings.threads = threads;
  settings.program = "test";
  std::filesystem::remove_all(settings.out);
  std::filesystem::create_directories(settings.out);
  std::vector<Trial> trials;
  for (const char* name : {"wall", "push"}) {
    trials.push_back(shipped_trial(name, disturbed(100, {"duration_s=3"})));
    trials.push_back(shipped_trial(name, disturbed(30, {"duration_s=3", "stage=ar"})));
  }
  const auto results = TrialRunner(std::move(trials), settings).run([](std::size_t, std::size_t) {});
  std::filesystem::remove_all(settings.out);
  return pretty_json(study_json(results));
}

TEST(Results, AreReproducibleForAnyNumberOfThreads) {
  const std::string once = results_text("shows_once", 1);
  EXPECT_GT(once.size(), 4000U);
  EXPECT_EQ(results_text("shows_twice", 2), once);
}

// Two users at the full message rate need about 375 kB/s in each direction, more than the line carries. Fails without
// rate control: packets would queue for longer and longer, and the cube would never be lifted.
TEST(NarrowLink, ReceivesOnlyItsBandwidthAndTwoUsersStillSqueezeABody) {
  for (const double carried : {300e3, 80e3}) {
    const Shown squeeze("squeeze", {"link.rtt_ms=50", "link.rate_limit_bytes_per_s=" + std::to_string(carried)});
    EXPECT_EQ(squeeze.outcome(), "completed") << carried;
    EXPECT_LE(squeeze["limit_cycle_m_per_s"], 0.002) << carried;
    EXPECT_LE(squeeze["force_step_max_n_per_ms"], 0.1) << carried;
    // At 80 kB/s the rate control needs 0.3 to 0.7 s to empty the queue that the first second has built up.
    EXPECT_LE(squeeze["energy_created_max_j"], carried > 100e3 ? 0.002 : 0.03) << carried;
  }
}

}  // namespace
}  // namespace tandem::lab
