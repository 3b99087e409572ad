// Nobody gets energy out of a law that is called passive; of the others it is shown how much they give. W is what the
// hand has put in since it began at rest, over the displacements that really happened under the force that was held.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <string>

#include "tests/lab/passivity_cases.hpp"

namespace tandem::lab {
namespace {

constexpr std::uint64_t kSeed = 20240611;

/// 300 N/m in light grip, damping k T.
HandRigSettings light_rig(std::string_view law) {
  HandRigSettings settings;
  settings.law = law;
  settings.coupling.damping_n_s_per_m = 0.3;
  settings.tool_mass_kg = 0.02;
  settings.plane_z_m = -0.002;
  return settings;
}

TEST(Passivity, OfPassiveLawsHoldsForHandsOnTheStiffestDevice) {
  const DeviceProfile device = find_device_profile("omega.6");
  for (const CouplingLawInfo& law : coupling_laws()) {
    if (!law.is_passive) continue;
    HandRigSettings settings = passive_rig(law.name, device, 1, 0.02);
    settings.hand = holding(settings.hand, device);
    settings.hand.encoder_step_m = settings.hand.encoder_step_rad = 0;
    EXPECT_GE(least_work_j(settings, kSeed, 2), -kAllowance_j) << described(settings, device.name, kSeed);
    EXPECT_GE(least_driven_work_j(settings, kHumanLimits, kSeed, 2), -kAllowance_j)
        << described(settings, device.name, kSeed);
  }
}

TEST(Passivity, OfAGuardedCouplingHoldsForADriverThatTurnsEveryTick) {
  for (const CouplingLawInfo& law : coupling_laws()) {
    HandRigSettings settings = light_rig(law.name);
    settings.is_guarded = true;
    EXPECT_GE(least_driven_work_j(settings, kTickLimits, kSeed, 2), -kAllowance_j)
        << described(settings, "a guarded device", kSeed);
  }
}

TEST(Passivity, OfPassiveLawsHoldsForSlowStrokes) {
  for (const CouplingLawInfo& law : coupling_laws()) {
    if (!law.is_passive) continue;
    EXPECT_GE(least_stroke_work_j(light_rig(law.name)), -kAllowance_j) << law.name;
  }
}

TEST(Passivity, IsLostBySwitchingAndByDirectRendering) {
  for (const CouplingLawInfo& law : coupling_laws()) {
    if (law.is_passive) continue;
    const HandRigSettings settings = light_rig(law.name);
    const double by_strokes_j = least_stroke_work_j(settings);
    const double by_driver_j = least_driven_work_j(settings, kHumanLimits, kSeed, 2);
    std::cout << law.name << " gave " << -1e3 * by_strokes_j << " mJ in 2.4 s of strokes, " << -1e3 * by_driver_j
              << " mJ to a driver in 2 s\n";
    // A hundred times what a passive law may be missing.
    EXPECT_LT(std::min(by_strokes_j, by_driver_j), -100 * kAllowance_j) << law.name << ", seed " << kSeed;
  }
}

TEST(Passivity, OfPassiveLawsIsLostToADriverThatTurnsEveryTickWithoutTheGuard) {
  // What the guard is for: no damping pays for a hand that turns as often as the force is updated.
  HandRigSettings settings = light_rig("spring-damper");
  settings.coupling.stiffness_n_per_m = 5000;
  settings.coupling.damping_n_s_per_m = 5;
  const double least_j = least_driven_work_j(settings, kTickLimits, kSeed, 2);
  std::cout << "spring-damper gave " << -1e3 * least_j << " mJ in 2 s\n";
  EXPECT_LT(least_j, -10 * kAllowance_j);
}

TEST(Saturation, ActsOnHandAndToolAlikeForEveryLaw) {
  for (const CouplingLawInfo& law : coupling_laws()) {
    HandRigSettings settings = light_rig(law.name);
    settings.coupling.force_limit_n = 1.0;
    HandRig rig(settings, random_path(kSeed, 2));
    double largest_n = 0;
    for (int i = 0; i < 2000; ++i) {
      const HandRigTick tick = rig.tick();
      largest_n = std::max(largest_n, tick.on_tool_W.f.norm());
      ASSERT_LE((tick.on_hand_W.f + tick.on_tool_W.f).norm(), 1e-12) << law.name << " at tick " << i;
    }
    EXPECT_LE(largest_n, settings.coupling.force_limit_n * (1 + 1e-12)) << law.name;
    EXPECT_GT(largest_n, 0.8) << law.name << " was not pressed hard enough to tell";
  }
}

}  // namespace
}  // namespace tandem::lab
