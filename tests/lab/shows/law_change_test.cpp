// Tests a change of the room's coupling law by the operator while hands press. The force must change without a step,
// and then follow the new law.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <string>
#include <utility>

#include "tests/lab/shows/pressed_wall.hpp"
#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {
namespace {

using namespace std::chrono_literals;

/// Time that covers the stability check for the hand's device and the blend between the laws.
constexpr Duration kWatched = 750ms;

Trial operated(const std::string& name, const Quantities& quantities) {
  Trial trial = shipped_trial(name, quantities);
  trial.experiment.users.at(0).role = server::UserRole::kOperator;
  return trial;
}

SessionTrace run(const Trial& trial, const OnClient& on_client = {}) {
  return run_virtual_session(trial.experiment, load_experiment_scene(trial.experiment), {}, on_client);
}

/// Returns a callback by which the first user sets each law at its time.
OnClient setting(const std::map<Duration, std::string>& laws) {
  return [laws, last = Duration{-1}](std::size_t user, Duration time, client::Client& client) mutable {
    if (user != 0) return;
    for (const auto& [at, law] : laws) {
      if (at > last && at <= time) client.session().send(client::command::SetLaw{law}, LocalTime{});
    }
    last = time;
  };
}

/// Returns conditions in which the hand presses on the wall so deeply that every law displays more than 1 N. The round
/// trip is 15 ms, so that the hand rests in every stage. With a longer delay the hand would oscillate: in stage "hold"
/// its speed is 0.04 mm/s at 18 ms, but 16 mm/s from 20 ms on.
/// Source  tandem-lab run wall --single --stage hold --set law=spring-damper --set link.rtt_ms=18,20
Quantities wall_with(const std::string& law, const std::string& stage) {
  return {"link.rtt_ms=15", "law=" + law, "stage=" + stage};
}

class ChangedLaw : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(ChangedLaw, WhileTheHandPressesMakesNoStepAndIsThenAsFromTheStart) {
  const auto [first, second] = GetParam();
  const OnClient there_and_back =
      setting({{kMoving.there, second}, {kMoving.back, first}, {kStill.there, second}, {kStill.back, first}});
  const Ticks changed = run(operated("wall", wall_with(first, "local-model")), there_and_back).users.at(0).ticks;
  const Ticks of_first = run(operated("wall", wall_with(first, "local-model"))).users.at(0).ticks;
  const Ticks of_second = run(operated("wall", wall_with(second, "local-model"))).users.at(0).ticks;
  for (const Duration when : {kMoving.there, kMoving.back, kStill.there, kStill.back}) {
    const double of_scene_n =
        std::max(largest_step_n(of_first, when, kWatched), largest_step_n(of_second, when, kWatched));
    ASSERT_GT(force_at_n(changed, when).norm(), 1) << "nothing was felt, so nothing was tested";
    EXPECT_LE(largest_step_n(changed, when, kWatched), 0.1 + of_scene_n) << to_seconds(when) << " s";
    EXPECT_GT(force_at_n(changed, when + kWatched).norm(), 1) << to_seconds(when) << " s: it is felt all the time";
  }
  const auto expect_same = [&](const Ticks& always, Duration time) {
    const Vec3 wanted = force_at_n(always, time);
    EXPECT_LE((force_at_n(changed, time) - wanted).norm(), 0.01 * wanted.norm()) << to_seconds(time) << " s";
  };
  expect_same(of_second, kStill.there + kWatched);
  expect_same(of_first, kStill.back + kWatched);
}

// Changes between the laws that any scene can use, in both directions. The adaptive law is omitted: it requires a fit
// and equals the linear law with other coefficients.
INSTANTIATE_TEST_SUITE_P(Pairs, ChangedLaw,
                         testing::Values(std::pair{"spring-damper", "stable-dynamic"},
                                         std::pair{"stable-dynamic", "spring-damper"}),
                         [](const auto& each) {
                           std::string name = std::string(each.param.first) + "_and_" + each.param.second;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

// The scene's law "qsa-dynamic" has force steps. A user who finds them too strong must be able to change to a law
// without steps at any time, and return later.
TEST(ChangedLawOfAnActiveScene, CalmsTheHand) {
  const Ticks changed = run(operated("wall", wall_with("qsa-dynamic", "local-model")),
                            setting({{1s, "spring-damper"}, {kStill.back, "qsa-dynamic"}}))
                            .users.at(0)
                            .ticks;
  EXPECT_LE(largest_step_n(changed, kMoving.there, kWatched), 0.1);
  EXPECT_LE(largest_step_n(changed, kStill.there, kWatched), 0.1);
  EXPECT_GT(force_at_n(changed, kStill.there + kWatched).norm(), 1);
  EXPECT_GT(largest_step_n(changed, 12s, kWatched), 0.5)
      << "the law jumps even by itself, therefore it cannot be selected elsewhere";
}

class ChangedLawInStage : public testing::TestWithParam<const char*> {};

// In the stages listed below, the displayed force comes from the server or from a coupling to the tool. A change of the
// law must affect it, but without a step.
TEST_P(ChangedLawInStage, MakesNoStepOfTheForce) {
  const Quantities quantities = wall_with("spring-damper", GetParam());
  const Ticks always = run(operated("wall", quantities)).users.at(0).ticks;
  const Ticks changed =
      run(operated("wall", quantities), setting({{kStill.there, "stable-dynamic"}, {kStill.back, "spring-damper"}}))
          .users.at(0)
          .ticks;
  for (const Duration when : {kStill.there, kStill.back}) {
    EXPECT_LE(largest_step_n(changed, when, kWatched), 0.1 + largest_step_n(always, when, kWatched))
        << to_seconds(when) << " s";
    EXPECT_GT(force_at_n(changed, when + kWatched).norm(), 1) << to_seconds(when) << " s";
  }
  const Vec3 at_last = force_at_n(always, kStill.back + kWatched);
  EXPECT_LE((force_at_n(changed, kStill.back + kWatched) - at_last).norm(), 0.01 * at_last.norm());
}

INSTANTIATE_TEST_SUITE_P(Stages, ChangedLawInStage, testing::Values("late-pose", "hold", "wave", "god-object"),
                         [](const auto& each) {
                           std::string name = each.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

// Two users hold a cube of 0.3 kg in the air by friction alone. With a curve sharpness of 4, the law "stable-dynamic"
// presses with more force than "spring-damper". Therefore neither law drops the cube. It falls only if the force drops
// during the change.
TEST(ChangedLawOfTwo, CausesNoForceStepForEitherUserAndDropsNoBody) {
  const Quantities quantities{"link.rtt_ms=50", "coupling.curve_sharpness=4"};
  const SessionTrace always = run(operated("squeeze", quantities));
  const SessionTrace changed =
      run(operated("squeeze", quantities), setting({{8500ms, "stable-dynamic"}, {9700ms, "spring-damper"}}));
  ASSERT_EQ(changed.users.size(), 2U);
  for (std::size_t user = 0; user < 2; ++user) {
    const Ticks& ticks = changed.users[user].ticks;
    for (const Duration when : {Duration(8500ms), Duration(9700ms)}) {
      EXPECT_LE(largest_step_n(ticks, when, kWatched), 0.1 + largest_step_n(always.users[user].ticks, when, kWatched))
          << user;
    }
    const Vec3 wanted = force_at_n(always.users[user].ticks, 11s);
    ASSERT_GT(wanted.norm(), 2) << "still held";
    EXPECT_GT((force_at_n(ticks, 9600ms) - force_at_n(always.users[user].ticks, 9600ms)).norm(), 0.15)
        << "the force must be that of the other law";
    EXPECT_LE((force_at_n(ticks, 11s) - wanted).norm(), 0.01 * wanted.norm()) << user;
  }
}

}  // namespace
}  // namespace tandem::lab
