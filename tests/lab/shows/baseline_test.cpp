// Tests stages that close the control loop through the network. They must become unstable at the delay that theory
// predicts from the coupling stiffness k_c, the delay and the damping of the hand.

#include <gtest/gtest.h>

#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {
namespace {

/// Minimum speed of a hand that oscillates, and maximum speed of a calm hand. They differ by a factor of 20.
constexpr double kRings_m_per_s = 0.02;
constexpr double kCalm_m_per_s = 0.001;

TEST(Hold, RingsOnTheWallAt100Ms) {
  EXPECT_GT(Shown("wall", bare("hold", 100))["limit_cycle_m_per_s"], kRings_m_per_s);
}

TEST(Hold, CreatesEnergyOnTheWallAt100MsWithoutPassivityController) {
  EXPECT_GT(Shown("wall", bare("hold", 100))["energy_created_max_j"], 0.001);
}

TEST(Hold, TwoUsersDropASqueezedBodyAt100Ms) {
  EXPECT_NE(Shown("squeeze", bare("hold", 100)).outcome(), "completed");
}

TEST(Wave, CreatesNoEnergyAtAnyDelay) {
  for (const char* experiment : {"wall", "push"}) {
    const Shown wave(experiment, bare("wave", 100));
    EXPECT_LE(wave["energy_created_max_j"], 0.001) << experiment;
    EXPECT_GE(wave["contact_force_ratio"], 0.3) << experiment;
  }
}

// In the stage late-pose, the tool at the server follows a delayed pose of the hand. Thus the tool transfers energy to
// the block that the hand does not supply. With passivity control, the room must limit the energy of the tool.
TEST(LatePose, PushesWithEnergyFromNowhereUnlessTheToolsEnergyIsLimited) {
  const Shown off("push", bare("late-pose", 100));
  const Shown on("push", {"stage=late-pose", "passivity=true", "link.rtt_ms=100"});
  EXPECT_GT(off["energy_created_max_j"], 0.5);
  EXPECT_LT(on["energy_created_max_j"], 0.1);
  EXPECT_GT(off["limit_cycle_m_per_s"], kRings_m_per_s);
  EXPECT_LE(on["limit_cycle_m_per_s"], 0.1 * off["limit_cycle_m_per_s"]);
  EXPECT_GT(on["contact_force_ratio"], 0.9) << "and the hand keeps its force";
  EXPECT_EQ(off["tool_energy_limited_fraction"], 0);
  EXPECT_GT(on["tool_energy_limited_fraction"], 0);
}

// When a force stops rising, the linear predictor continues to extrapolate the rise until newer states arrive.
// Therefore its force overshoots, the more the longer the delay is.
TEST(Linear, Overshoots) {
  const Shown linear("wall", bare("linear", 100));
  const Shown hold("wall", bare("hold", 100));
  EXPECT_GT(linear["contact_error_rms_n"], hold["contact_error_rms_n"]);
  EXPECT_GT(linear["peak_force_n"], hold["peak_force_n"]);
}

TEST(Ar, BeatsHoldAt30MsAndRingsBy100Ms) {
  const Shown ar("wall", bare("ar", 30));
  const Shown hold("wall", bare("hold", 30));
  EXPECT_LE(ar["limit_cycle_m_per_s"], kCalm_m_per_s);
  EXPECT_GT(hold["limit_cycle_m_per_s"], kRings_m_per_s);
  EXPECT_LT(ar["contact_error_rms_n"], hold["contact_error_rms_n"]);
  EXPECT_GT(Shown("wall", bare("ar", 100))["limit_cycle_m_per_s"], kRings_m_per_s);
}

}  // namespace
}  // namespace tandem::lab
