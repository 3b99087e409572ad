// The whole region in which laws are called passive: every shipped device profile, soft to as stiff as it can show,
// tools of 0.02 to 2 kg, three hands.
#include <gtest/gtest.h>

#include "tests/lab/passivity_cases.hpp"

namespace tandem::lab {
namespace {

/// Calls `check(settings, device, seed)` for every law, profile, stiffness and mass, each with its own seed.
template <class Check>
void for_region(bool only_passive, const Check& check) {
  std::uint64_t seed = 1;
  for (const CouplingLawInfo& law : coupling_laws()) {
    if (only_passive && !law.is_passive) continue;
    for (const DeviceProfile& device : load_device_profiles(shipped_device_profiles())) {
      for (const double share : {0.05, 1.0}) {
        for (const double mass_kg : kToolMasses_kg)
          check(passive_rig(law.name, device, share, mass_kg), device, seed++);
      }
    }
  }
}

TEST(PassivityRegion, HoldsForRandomPathsOfThreeHands) {
  for_region(true, [](HandRigSettings settings, const DeviceProfile& device, std::uint64_t seed) {
    for (const CheckedHand& hand : checked_hands()) {
      if (hand.mass_kg <= 0) continue;
      settings.hand = holding(hand_of(hand), device);
      settings.hand.encoder_step_m = settings.hand.encoder_step_rad = 0;
      ASSERT_GE(least_work_j(settings, seed, 2), -kAllowance_j)
          << described(settings, device.name, seed) << ", hand " << hand.name;
    }
  });
}

TEST(PassivityRegion, HoldsForADriverAsQuickAsAHandWhoTurnsWhereItPays) {
  for_region(true, [](const HandRigSettings& settings, const DeviceProfile& device, std::uint64_t seed) {
    ASSERT_GE(least_driven_work_j(settings, kHumanLimits, seed, 2), -kAllowance_j)
        << described(settings, device.name, seed);
  });
}

TEST(PassivityRegion, HoldsWithTheGuardForADriverWhoTurnsEveryTickWhereItPays) {
  for_region(false, [](HandRigSettings settings, const DeviceProfile& device, std::uint64_t seed) {
    settings.is_guarded = true;
    ASSERT_GE(least_driven_work_j(settings, kTickLimits, seed, 2), -kAllowance_j)
        << described(settings, device.name, seed);
  });
}

}  // namespace
}  // namespace tandem::lab
