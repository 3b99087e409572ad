// Tests changes of settings in the window while a hand presses on a wall. The force must change without a step.
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
/// Times within the 10.5 s of the experiment "push": the hand moves into the block from 4.7 s to 5.5 s, and then rests
/// until 9.5 s.
constexpr Duration kPushing = 4900ms, kHolding = 7s;

Ticks pressed(const OnClient& on_client) {
  const Trial trial = shipped_trial("wall", {"link.rtt_ms=20"});
  return run_virtual_session(trial.experiment, load_experiment_scene(trial.experiment), {}, on_client)
      .users.at(0)
      .ticks;
}

/// Changes the stage to `there` and back, once while the hand moves and once while it rests.
Ticks pressed_while(const client::StageSettings& there) {
  bool is_switched = false;
  return pressed([&](std::size_t, Duration time, client::Client& client) {
    const auto is_in = [time](const Change& change) { return time >= change.there && time < change.back; };
    const bool should_be_switched = is_in(kMoving) || is_in(kStill);
    if (std::exchange(is_switched, should_be_switched) == should_be_switched) return;
    client.set_stage(should_be_switched ? there : client::StageSettings{});
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

/// Returns the trace of a hand that pushes a block of 0.5 kg at a round trip of 100 ms. If `is_changed`, the local
/// model is replaced by a new model of the same scene in the middle of the push, and again while the hand rests.
UserTrace pushed(bool is_changed) {
  const Trial trial = shipped_trial("push", {"link.rtt_ms=100"});
  bool was_switched = false;
  const OnClient change = [&](std::size_t, Duration time, client::Client& client) {
    const bool is_switched = time >= kPushing && time < kHolding;
    if (!is_changed || std::exchange(was_switched, is_switched) == is_switched) return;
    client::StageSettings same;
    if (is_switched) same.wave.linear_n_s_per_m *= 2;  // affects only the stage "wave", which is not in use
    client.set_stage(same);
  };
  return run_virtual_session(trial.experiment, load_experiment_scene(trial.experiment), {}, change).users.at(0);
}

TEST(ChangedModel, ANewModelOfTheSameSceneContinuesTheStateOfTheOldOne) {
  const UserTrace changed = pushed(true), usual = pushed(false);
  ASSERT_EQ(changed.ticks.size(), usual.ticks.size());
  for (const Duration when : {kPushing, kHolding}) {
    ASSERT_GT(force_at_n(usual.ticks, when).norm(), 0.5) << "nothing was felt, so nothing was tested";
    EXPECT_LE(largest_step_n(changed.ticks, when, kWatched), largest_step_n(usual.ticks, when, kWatched) + 0.1);
    double apart_n = 0, apart_m = 0;
    for (std::size_t k = 0; k < usual.ticks.size(); ++k) {
      if (usual.ticks[k].time <= when || usual.ticks[k].time > when + kWatched) continue;
      apart_n = std::max(apart_n, (changed.ticks[k].displayed_D.f - usual.ticks[k].displayed_D.f).norm());
      apart_m = std::max(apart_m, (changed.ticks[k].view_W - usual.ticks[k].view_W).norm());
    }
    EXPECT_LE(apart_n, 0.15);
    EXPECT_LE(apart_m, 5e-4);
  }
  EXPECT_LE(changed.energy_to_hand_j, usual.energy_to_hand_j + 1e-3);
}

// The delay of each direction rises by 40 ms while the hand presses, and later falls again.
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
