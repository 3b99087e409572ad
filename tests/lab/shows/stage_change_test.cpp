// What a person changes at a window while a hand presses on a wall: no step of the force.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "tests/lab/shows/pressed_wall.hpp"
#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {
namespace {

using namespace std::chrono_literals;

constexpr Duration kWatched = 700ms;

Ticks pressed(const OnClient& on_client) {
  const Trial trial = shipped_trial("wall", {"link.rtt_ms=20"});
  return run_virtual_session(trial.experiment, load_experiment_scene(trial.experiment), {}, on_client)
      .users.at(0)
      .ticks;
}

/// There and back, once while the hand moves and once while it is still.
Ticks pressed_while(const client::StageSettings& there) {
  bool is_there = false;
  return pressed([&](std::size_t, Duration time, client::Client& client) {
    const auto is_in = [time](const Change& change) { return time >= change.there && time < change.back; };
    const bool should_be_there = is_in(kMoving) || is_in(kStill);
    if (std::exchange(is_there, should_be_there) == should_be_there) return;
    client.set_stage(should_be_there ? there : client::StageSettings{});
  });
}

class Changed : public testing::TestWithParam<client::StageSettings> {};

TEST_P(Changed, WhileTheHandPressesMakesNoStepOfTheForce) {
  const Ticks ticks = pressed_while(GetParam());
  for (const Change& change : {kMoving, kStill}) {
    ASSERT_GT(force_at_n(ticks, change.there).norm(), 2) << "nothing was felt, so nothing was tested";
    for (const Duration when : {change.there, change.back}) {
      EXPECT_LE(largest_step_n(ticks, when, kWatched), 0.1) << to_seconds(when) << " s";
      EXPECT_GT(force_at_n(ticks, when + kWatched).norm(), 1) << to_seconds(when) << " s: it is felt all the time";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Stage, Changed,
    testing::Values(client::StageSettings{.name = "late-pose"}, client::StageSettings{.name = "hold"},
                    client::StageSettings{.name = "ar-spline"}, client::StageSettings{.name = "wave"},
                    client::StageSettings{.name = "god-object"}, client::StageSettings{.predictor = "none"},
                    client::StageSettings{.predictor = "ar"}, client::StageSettings{.passivity = false}),
    [](const auto& each) {
      std::string name = each.param.name + "_" + each.param.predictor;
      if (!each.param.passivity) name += "_bare";
      std::ranges::replace(name, '-', '_');
      return name;
    });

// Half a round trip of 10 ms more each way, and less again.
TEST(ChangedDelay, WhileTheHandPressesMakesNoStepOfTheForce) {
  Trial trial = shipped_trial("wall", {"link.rtt_ms=20"});
  ExperimentUser& user = trial.experiment.users.at(0);
  user.up.delay_path.points =
      user.down.delay_path.points = {{Duration{0}, Duration{0}}, {kMoving.there, Duration{0}}, {kMoving.there, 40ms},
                                     {kStill.there, 40ms},       {kStill.there, Duration{0}},  {60s, Duration{0}}};
  user.up.delay_path.starts_anywhere = user.down.delay_path.starts_anywhere = false;
  const Ticks ticks = run_virtual_session(trial.experiment, load_experiment_scene(trial.experiment)).users.at(0).ticks;
  for (const Duration when : {kMoving.there, kStill.there}) {
    EXPECT_GT(force_at_n(ticks, when).norm(), 2);
    EXPECT_LE(largest_step_n(ticks, when, kWatched), 0.1);
  }
}

}  // namespace
}  // namespace tandem::lab
