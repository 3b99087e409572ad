// Tests that two simulated hands solve a figure of the T puzzle over a link with delay, jitter and loss.
#include <gtest/gtest.h>

#include <array>

#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {
namespace {

using Reports = std::array<std::shared_ptr<const client::GameReport>, 2>;

Reports play(const Quantities& quantities) {
  const Trial trial = shipped_trial("t_puzzle", quantities);
  Reports reports;
  run_virtual_session(
      trial.experiment, load_experiment_scene(trial.experiment), {},
      [&](std::size_t user, Duration, client::Client& client) { reports.at(user) = client.session().game(); });
  return reports;
}

std::size_t count(const client::GameReport& report, wire::GameEvent::Kind kind) {
  return static_cast<std::size_t>(std::ranges::count(report.events, kind, &wire::GameEvent::kind));
}

TEST(TPuzzleSession, TwoHandsSolveTheJuniorFigureOver100MsWithJitterAndLoss) {
  for (const char* const seed : {"seed=1", "seed=2", "seed=3"}) {
    const Reports reports = play(disturbed(100, {seed}));
    for (const auto& report : reports) {
      ASSERT_NE(report, nullptr) << seed;
      EXPECT_EQ(count(*report, wire::GameEvent::GOAL_REACHED), 1U) << seed;
      EXPECT_EQ(report->state.level(), 1U) << seed;
      EXPECT_EQ(report->state.score(), 10) << seed;
    }
  }
}

TEST(TPuzzleSession, TheSameTrialGivesTheSameEvents) {
  const Reports first = play(disturbed(100)), second = play(disturbed(100));
  ASSERT_NE(first[0], nullptr);
  ASSERT_NE(second[0], nullptr);
  ASSERT_EQ(first[0]->events.size(), second[0]->events.size());
  for (std::size_t i = 0; i < first[0]->events.size(); ++i) {
    EXPECT_EQ(first[0]->events[i].SerializeAsString(), second[0]->events[i].SerializeAsString());
  }
}

}  // namespace
}  // namespace tandem::lab
