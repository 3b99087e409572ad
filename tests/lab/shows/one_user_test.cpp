// Tests the default stage with one user over a link with delay, jitter and loss. If only this user moves a body, the
// force must show no effect of the link.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {
namespace {

using namespace std::chrono_literals;
using testing::Values;

/// Returns whether a metric exceeds a bound. An undefined metric exceeds no bound.
bool is_above(double value, double bound) {
  return std::isfinite(value) && value > bound;
}

TEST(Free, DragsNoMoreThan50MillinewtonAt200Ms) {
  EXPECT_LE(Shown("free", disturbed(200))["free_drag_rms_n"], 0.05);
}

TEST(Free, DragsMoreThanANewtonWhereTheToolIsShownLate) {
  EXPECT_GT(Shown("free", bare("late-pose", 200))["free_drag_rms_n"], 1.0);
}

TEST(Wall, IsAsHardAndAsStillAt200MsAsWithoutDelay) {
  const Shown wall("wall", disturbed(200));
  EXPECT_LE(wall["contact_error_fraction"], 0.05);
  EXPECT_LE(wall["limit_cycle_m_per_s"], 0.001);
  EXPECT_NEAR(wall["felt_stiffness_ratio"], 1, 0.10);
}

TEST(Wall, HasNoLimitCycleAt300Ms) {
  EXPECT_LE(Shown("wall", disturbed(300))["limit_cycle_m_per_s"], 0.001);
}

class Sliding : public testing::TestWithParam<At> {};

TEST_P(Sliding, ShowsTheForceWithin15Percent) {
  const Shown shown(GetParam().experiment, GetParam().quantities());
  EXPECT_GT(shown["contact_force_mean_n"], 1.0) << "there is something to be felt";
  EXPECT_LE(shown["contact_error_fraction"], 0.15);
}

INSTANTIATE_TEST_SUITE_P(Default, Sliding, Values(At{"curve", 100}, At{"rim", 100}, At{"bunny", 100}),
                         [](const auto& each) { return name_of_case(each); });

TEST(Rim, IsNotFeltLongerThan20MsAfterTheToolHasLeftIt) {
  EXPECT_LE(Shown("rim", disturbed(100))["ghost_contact_ms"], 20);
}

TEST(Rim, IsFeltForAsLongAsTheDelayWhereForcesAreHeld) {
  EXPECT_GT(Shown("rim", bare("hold", 100))["ghost_contact_ms"], 50);
}

/// Returns the largest difference of the force on the hand between two runs, tick by tick.
double largest_difference_n(const SessionTrace& a, const SessionTrace& b) {
  double largest_n = 0;
  const std::size_t count = std::min(a.users[0].ticks.size(), b.users[0].ticks.size());
  for (std::size_t i = 0; i < count; ++i) {
    largest_n = std::max(largest_n, (a.users[0].ticks[i].displayed_D.f - b.users[0].ticks[i].displayed_D.f).norm());
  }
  return largest_n;
}

// The god-object detects contact with a wall locally, without the server. The force must therefore be identical at any
// delay.
TEST(GodObject, FeelsAWallToTheLastBitAsWithoutDelay) {
  const Shown at_0("wall", {"stage=god-object", "link.rtt_ms=0"});
  EXPECT_EQ(at_0.outcome(), "completed");
  EXPECT_GT(at_0["contact_force_mean_n"], 1.0);
  // The wall of the god-object is rigid. In the reference run, the wall yields slightly because of the coupling.
  EXPECT_NEAR(at_0["felt_stiffness_ratio"], 1.02, 0.01);
  for (const double round_trip_ms : {100.0, 200.0}) {
    const Shown late("wall", {"stage=god-object", "link.rtt_ms=" + std::to_string(round_trip_ms)});
    EXPECT_EQ(largest_difference_n(at_0.trace(), late.trace()), 0) << round_trip_ms << " ms";
    EXPECT_LE(late["limit_cycle_m_per_s"], 0.001);
  }
}

TEST(GodObject, IsRefusedWhereThereAreOnlyMolecules) {
  Quantities quantities{"stage=god-object"};
  try {
    const Shown docking("docking", quantities);
    FAIL() << "accepted";
  } catch (const CouldNotJoin& error) {
    EXPECT_NE(std::string(error.what()).find("use stage local-model"), std::string::npos) << error.what();
  }
}

TEST(Push, IsFeltWithin150MillinewtonAt200Ms) {
  EXPECT_LE(Shown("push", disturbed(200))["contact_error_rms_n"], 0.15);
}

class PushOfAnotherMass : public testing::TestWithParam<double> {};

TEST_P(PushOfAnotherMass, IsCalm) {
  const Shown push("push", disturbed(200, {"model.mass_scale=" + std::to_string(GetParam())}));
  EXPECT_LE(push["limit_cycle_m_per_s"], 0.001);
  EXPECT_LE(push["force_step_max_n_per_ms"], 0.1);
  EXPECT_EQ(push["slew_activations"], 0);
}

INSTANTIATE_TEST_SUITE_P(ThanTheModelBelieves, PushOfAnotherMass, testing::Values(0.6, 1.4));

TEST(Soft, IsAsStiffAndAsStillAt200MsAsWithoutDelay) {
  const Shown soft("soft", disturbed(200));
  EXPECT_NEAR(soft["felt_stiffness_ratio"], 1, 0.10);
  EXPECT_LE(soft["limit_cycle_m_per_s"], 0.001);
}

TEST(Soft, HasAnEighthOfTheTextureAbove60HzThatHeldForcesHave) {
  const double held_n = Shown("soft", bare("hold", 100))["force_above_60_hz_n"];
  EXPECT_GT(held_n, 0.001);
  EXPECT_LE(Shown("soft", disturbed(100))["force_above_60_hz_n"], 0.125 * held_n);
}

// The round trip rises from 50 ms to 250 ms (100 ms more in each direction) while the hand presses. The local model
// contains the wall and must display it during the gap.
TEST(DelayStep, OfATenthOfASecondEachWayIsHardlyFeltOnAWall) {
  const auto displayed_after = [](Duration more) {
    Trial trial = shipped_trial("wall", {"link.rtt_ms=50"});
    ExperimentUser& user = trial.experiment.users.at(0);
    user.up.delay_path.points =
        user.down.delay_path.points = {{Duration{0}, Duration{0}}, {11s, Duration{0}}, {11s, more}, {60s, more}};
    user.up.delay_path.starts_anywhere = user.down.delay_path.starts_anywhere = false;
    return run_virtual_session(trial.experiment, load_experiment_scene(trial.experiment)).users.at(0).ticks;
  };
  const std::vector<TickSample> even = displayed_after(Duration{0}), step = displayed_after(100ms);
  double farthest_n = 0, felt_n = 0;
  for (std::size_t k = 0; k < std::min(even.size(), step.size()); ++k) {
    felt_n = std::max(felt_n, even[k].displayed_D.f.norm());
    farthest_n = std::max(farthest_n, (step[k].displayed_D.f - even[k].displayed_D.f).norm());
  }
  EXPECT_GT(felt_n, 3) << "nothing was felt, so nothing was tested";
  EXPECT_LE(farthest_n, 0.5);
}

/// Contact with fixed bodies, and with bodies that only this user moves, at delays from 0 to 300 ms.
class Alone : public testing::TestWithParam<At> {};

TEST_P(Alone, MakesNoStepNoEnergyAndNoWorkForThePassivityController) {
  const Shown shown(GetParam().experiment, GetParam().quantities());
  EXPECT_LE(shown["force_step_max_n_per_ms"], 0.1);
  EXPECT_EQ(shown["slew_activations"], 0);
  // After a gap, the server's handle catches up with the hand, which creates more energy.
  EXPECT_LE(shown["energy_created_max_j"], shown.was_silent() ? 0.01 : 0.0025);
  EXPECT_FALSE(is_above(shown["passivity_dissipated_fraction"], 0.05)) << shown["passivity_dissipated_fraction"];
  EXPECT_EQ(shown["tool_energy_limited_fraction"], 0);
  EXPECT_EQ(shown.outcome(), "completed");
}

INSTANTIATE_TEST_SUITE_P(Default, Alone,
                         Values(At{"free", 0}, At{"free", 100}, At{"free", 200}, At{"free", 300},  //
                                At{"wall", 0}, At{"wall", 100}, At{"wall", 200}, At{"wall", 300},  //
                                At{"curve", 0}, At{"curve", 100}, At{"curve", 200}, At{"curve", 300}, At{"rim", 0},
                                At{"rim", 100}, At{"rim", 200}, At{"rim", 300},  //
                                At{"bunny", 0}, At{"bunny", 100}, At{"bunny", 200}, At{"bunny", 300}, At{"push", 0},
                                At{"push", 100}, At{"push", 200}, At{"push", 300},  //
                                At{"soft", 0}, At{"soft", 100}, At{"soft", 200}, At{"soft", 300}),
                         [](const auto& each) { return name_of_case(each); });

}  // namespace
}  // namespace tandem::lab
