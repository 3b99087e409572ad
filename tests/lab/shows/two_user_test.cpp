// Tests two hands on one body, which is lifted by friction alone or handed over. The control loop closes through the
// partner.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "tests/lab/shows/deadband.hpp"
#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {
namespace {

Quantities at(double near_ms, double far_ms) {
  return disturbed(far_ms, {"users.anna.link.rtt_ms=" + std::to_string(near_ms)});
}

class Squeeze : public testing::TestWithParam<std::pair<double, double>> {};

TEST_P(Squeeze, IsLiftedCarriedAndNotDropped) {
  const Shown squeeze("squeeze", at(GetParam().first, GetParam().second));
  EXPECT_EQ(squeeze.outcome(), "completed");
  EXPECT_LE(squeeze["limit_cycle_m_per_s"], 0.002);
  EXPECT_GE(squeeze["hold_force_ratio"], 0.95);
  EXPECT_GE(squeeze["hold_force_least_ratio"], 0.85);
  EXPECT_LE(squeeze["force_step_max_n_per_ms"], 0.1);
  EXPECT_LE(squeeze["energy_created_max_j"], 0.002);
}

INSTANTIATE_TEST_SUITE_P(RoundTrips, Squeeze, testing::Values(std::pair(100.0, 100.0), std::pair(25.0, 200.0)));

TEST(SqueezeFarApart, IsCalmAndAsFirmAsWithoutDelay) {
  for (const double round_trip_ms : {200.0, 300.0}) {
    const Shown squeeze("squeeze", disturbed(round_trip_ms));
    EXPECT_EQ(squeeze.outcome(), "completed") << round_trip_ms;
    EXPECT_LE(squeeze["limit_cycle_m_per_s"], 0.005) << round_trip_ms;
    EXPECT_GE(squeeze["hold_force_ratio"], 0.85) << round_trip_ms;
  }
}

// At zero delay, friction with a coefficient of 0.5 can carry 3.6 N, and the weight is 2.94 N. A stage that displays
// delayed forces must drop the cube.
TEST_P(Squeeze, OfAFrictionOfAHalfIsDroppedByEveryStageThatWaitsForTheServer) {
  for (const char* stage : {"late-pose", "hold", "linear", "ar", "ar-spline", "wave"}) {
    Quantities quantities = bare(stage, GetParam().second);
    quantities.push_back("users.anna.link.rtt_ms=" + std::to_string(GetParam().first));
    for (const char* thing : {"bodies.cube", "tools.near", "tools.far"}) {
      quantities.push_back("scene." + std::string(thing) + ".friction=0.5");
    }
    EXPECT_NE(Shown("squeeze", quantities).outcome(), "completed") << stage;
  }
}

TEST(SqueezeSlippery, IsLiftedAndNotDroppedAt200Ms) {
  const Shown squeeze("squeeze_slippery", disturbed(200));
  EXPECT_EQ(squeeze.outcome(), "completed");
  EXPECT_GE(squeeze["hold_force_ratio"], 0.85);
  EXPECT_LE(squeeze["force_step_max_n_per_ms"], 0.1);
  EXPECT_EQ(squeeze["slew_activations"], 0);
}

// Both hands carry the body at 150 mm/s along the direction in which they press. During a gap of 85 ms they move by 13
// mm. Fails if the force then becomes so small that the body falls.
TEST(CarryAlongFast, IsNotDroppedInAGapOfTheNetwork) {
  const Shown shown("carry_along_fast", disturbed(100, {"seed=25"}));
  EXPECT_GT(shown["silence_max_ms"], 80);
  EXPECT_FALSE(shown.was_silent());
  EXPECT_EQ(shown.outcome(), "completed");
  EXPECT_LE(shown["energy_created_max_j"], 0.002);
}

/// Bodies that several users hold: carried, rotated and pulled apart.
class Together : public testing::TestWithParam<At> {};

TEST_P(Together, IsFeltAsAtTheServerAndNotDropped) {
  const Shown shown(GetParam().experiment, GetParam().quantities());
  const bool is_near = GetParam().round_trip_ms <= 100;
  EXPECT_EQ(shown.outcome(), "completed");
  const bool is_easy = is_near && GetParam().experiment != std::string("four_hands");
  EXPECT_LE(shown["path_error_of_peak"], is_easy ? 0.1 : 0.25);
  EXPECT_GE(shown["hold_force_ratio"], is_near ? 0.95 : 0.85);
  EXPECT_LE(shown["limit_cycle_m_per_s"], 0.002);
  // At a large delay the bar is tilted when it is set down. The end that touches first causes a force step, even at the
  // server (0.42 N/ms, which is accepted).
  const bool lands_tilted = !is_near && GetParam().experiment == std::string("turn_together");
  EXPECT_LE(shown["force_step_max_n_per_ms"], lands_tilted ? 0.5 : 0.3);
  EXPECT_LE(shown["energy_created_max_j"], is_near ? 0.002 : 0.03);
  EXPECT_LE(shown["energy_created_max_j"], std::max(0.002, 0.25 * shown["energy_of_late_display_j"]));
}

INSTANTIATE_TEST_SUITE_P(Default, Together,
                         testing::Values(At{"carry_along", 100}, At{"carry_along_fast", 100}, At{"carry_across", 100},
                                         At{"carry_across_fast", 100}, At{"tug_of_war", 100}, At{"turn_together", 100},
                                         At{"two_blocks", 100}, At{"three_hands", 100}, At{"four_hands", 100},
                                         At{"turn_squeezed", 100}, At{"two_carry", 100}, At{"two_plates", 100},
                                         At{"box_on_box", 100}, At{"carry_along", 200}, At{"tug_of_war", 200},
                                         At{"turn_together", 200}),
                         [](const auto& each) { return name_of_case(each); });

// Two users hold and rotate one bar. The local model predicts the fraction of the bar's motion by which the partner
// yields. Fails if this fraction is too large: the bar then oscillates with 2.5 mm/s one second after the stop and
// creates 13 mJ. With the present fraction it creates at most 2.2 mJ.
TEST(Together, ABarTurnedByTwoUsersComesToRest) {
  for (const char* const seed : {"seed=10", "seed=16"}) {
    const Shown shown("turn_together", disturbed(100, {seed}));
    EXPECT_LE(shown["limit_cycle_m_per_s"], 0.002) << seed;
    EXPECT_LE(shown["energy_created_max_j"], 0.003) << seed;
  }
}

// A user presses a held box on a box that the partner holds. Fails if the model predicts that the partner yields to
// that pressure: 3 mJ would be created when the boxes separate.
TEST(Together, WhatOneHoldsAndTheOtherPressesOnThroughAnotherThingMakesNoEnergy) {
  for (const char* const seed : {"seed=4", "seed=25"}) {
    EXPECT_LE(Shown("box_on_box", disturbed(100, {seed}))["energy_created_max_j"], 0.001) << seed;
  }
}

// Fails if the plate stops on its way up during a gap of 85 ms. A stopped plate would catch up after the gap, oscillate
// on its coupling and create 4 mJ.
TEST(Together, ABodyCarriedByOneUserContinuesDuringANetworkGap) {
  for (const char* const seed : {"seed=18", "seed=25"}) {
    const Shown shown("two_plates", disturbed(100, {seed}));
    EXPECT_GT(shown["silence_max_ms"], 80) << seed;
    EXPECT_FALSE(shown.was_silent()) << seed;
    EXPECT_LE(shown["energy_created_max_j"], 0.002) << seed;
  }
}

// Two users carry the plate at 125 mm/s in changing directions. Fails if the local model assumes that the partner's
// hand stays in place; the user would then feel a drag of 1.25 N.
TEST(Together, APlateCarriedByTwoDragsByLessThanATenthOfItsWeight) {
  EXPECT_LE(Shown("two_carry", disturbed(100))["contact_error_rms_n"], 0.29);
}

// The local model must estimate the impedance of the partner's hand during contact. Fails if it assumes the same
// impedance for every partner.
TEST(Together, HandsOfAnyWeightAndStiffness) {
  for (const char* hand : {"hand.mass_kg=1.5", "hand.mass_kg=0.05", "hand.stiffness_n_per_m=600"}) {
    const Shown squeeze("squeeze", disturbed(100, {hand}));
    EXPECT_EQ(squeeze.outcome(), "completed") << hand;
    EXPECT_LE(squeeze["path_error_of_peak"], 0.1) << hand;
    EXPECT_LE(squeeze["limit_cycle_m_per_s"], 0.01) << hand;
  }
}

class Peg : public testing::TestWithParam<double> {};

TEST_P(Peg, IsHandedOverAndPutIntoTheHole) {
  const Shown peg("peg", disturbed(GetParam()));
  EXPECT_EQ(peg.outcome(), "completed");
  // The partner's release is received only after the delay. The resulting error grows with the square root of the delay
  // (lab/TOUCH.md).
  const double bound = 0.125 * std::sqrt(std::max(1.0, GetParam() / 200));
  EXPECT_LE(peg["contact_error_fraction"], bound) << "it is gripped where it is without a delay";
  EXPECT_LE(peg["limit_cycle_m_per_s"], 0.002);
  EXPECT_LE(peg["force_step_max_n_per_ms"], 0.12);
  EXPECT_EQ(peg["slew_activations"], 0);
  EXPECT_LE(peg["energy_created_max_j"], 0.002);
}

// At a round trip of 25 ms, the delay is as short as the permitted time difference between a touch at the client and
// the same touch at the server.
INSTANTIATE_TEST_SUITE_P(RoundTrips, Peg, testing::Values(25.0, 100.0, 300.0));

/// Returns the distance between the watched body as displayed to a user and at the server, at a time when it rests.
double out_of_place_m(const SessionTrace& trace, std::size_t user, double at_s) {
  const auto tick = std::ranges::find_if(trace.users.at(user).ticks,
                                         [&](const TickSample& each) { return each.time >= from_seconds(at_s); });
  const auto sample =
      std::ranges::find_if(trace.bodies, [&](const BodiesSample& each) { return each.time >= from_seconds(at_s); });
  return (tick->view_W - sample->X_WB.at(trace.watched_body.value()).p).norm();
}

// Compares the displayed position of the peg with that at the server: after the handover, on the way into the hole, and
// in the hole.
TEST(HandOver, LeavesThePegWhereTheReceiverHasIt) {
  for (const double round_trip_ms : {100.0, 200.0}) {
    const Shown peg("peg", disturbed(round_trip_ms));
    for (const double at_s : {9.7, 14.0, 17.5}) {
      EXPECT_LE(out_of_place_m(peg.trace(), 1, at_s), 0.002) << round_trip_ms << " ms, at " << at_s << " s";
    }
  }
}

TEST(Deadband, OfATenthLeavesOut85PercentOfTheDatagramsAndNotTheForceOfThePeg) {
  expect_few_datagrams("peg");
}

// A loss burst of 60 ms makes the displayed force decay (see expect_recovery_from_bursts()), so the hand moves. Fails
// if the local model then diverges from the server.
TEST(Deadband, DoesNotDivergeOnThePegWhenATenthIsLost) {
  const Shown lossy("peg", {"link.rtt_ms=100", "deadband=0.1", "link.loss=0.1"});
  EXPECT_EQ(lossy.outcome(), "completed");
  EXPECT_LE(lossy["contact_error_fraction"], 0.15);
  EXPECT_LE(lossy["limit_cycle_m_per_s"], 0.02);
  EXPECT_LE(lossy["force_step_max_n_per_ms"], 0.1);
}

}  // namespace
}  // namespace tandem::lab
