// Tests that a hand cannot extract energy from a law that is marked as passive. For the other laws, the test measures
// how much energy can be extracted.
//
// Terms:
//   W       work of the hand since it began at rest [J], from the true displacements under the held force; a negative W
//           is extracted energy
//   driver  worst-case motion of the hand, which chooses its direction so as to gain energy
//   k T     smallest permitted damping: stiffness k times period T
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <string>

#include "tests/lab/studies/rendering/passivity_cases.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::lab {
namespace {

constexpr std::uint64_t kUsualSeed = 20240611;

/// Returns a rig with 300 N/m, a light grip, and damping k T.
HandRigSettings light_rig(std::string_view law) {
  HandRigSettings settings;
  settings.law = law;
  settings.coupling.damping_n_s_per_m = 0.3;
  settings.tool_mass_kg = 0.02;
  settings.plane_z_m = -0.002;
  return settings;
}

double least_driven_j(const HandRigSettings& settings, const DriverLimits& limits, std::uint64_t seed) {
  return least_driven_work(settings, DriverWay::kDown, limits, seed, 2).from_rest_j;
}

/// Returns a rig with the largest stiffness that the device can display, and damping k T.
HandRigSettings stiffest_rig(std::string_view law, const devices::DeviceProfile& device) {
  HandRigSettings settings = rig_on(law, device, coupling_on(device, 1, 1), 0.02);
  settings.hand = devices::holding(settings.hand, device);
  return settings;
}

/// Returns the smallest W of a random hand path and of a driver in each direction, all within the limits of human
/// motion.
double least_of_people_j(const HandRigSettings& settings, std::uint64_t seed) {
  double least_j = least_work_j(settings, seed, 1);
  for (const DriverWay way : kDriverWays) {
    least_j = std::min(least_j, least_driven_work(settings, way, human_limits(way), seed, 1).from_start_j);
  }
  return least_j;
}

/// Names of two devices: the one with the largest stiffness, and the stiffest of those that display torque.
constexpr std::array kDevices{"omega.6", "sigma.7"};

TEST(Passivity, OfPassiveLawsHoldsForHandsOnTheStiffestDevices) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    if (!law.is_passive) continue;
    for (const char* name : kDevices) {
      HandRigSettings settings = stiffest_rig(law.name, devices::find_device_profile(name));
      make_exact(settings.hand);
      EXPECT_GE(least_of_people_j(settings, seed), -kMaxCreated_j) << described(settings, name, seed);
    }
  }
}

TEST(Passivity, OfPassiveLawsHoldsForHandsBehindTheEncoder) {
  // The law uses the encoder's position, but W uses the true position of the hand. Therefore W includes the effect of
  // the encoder steps.
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    if (!law.is_passive) continue;
    for (const char* name : kDevices) {
      const HandRigSettings settings = stiffest_rig(law.name, devices::find_device_profile(name));
      const double least_j = least_of_people_j(settings, seed);
      std::cout << law.name << " on " << name << " with its encoder: least W " << 1e6 * least_j << " µJ\n";
      EXPECT_GE(least_j, -kMaxCreated_j) << described(settings, name, seed);
    }
  }
}

TEST(Passivity, OfACouplingWithPassivityControllerHoldsForDriversThatTurnEveryTick) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    HandRigSettings settings = light_rig(law.name);
    settings.is_passivity_controlled = true;
    for (const DriverWay way : kDriverWays) {
      EXPECT_GE(least_driven_work(settings, way, tick_limits(way), seed, 1).from_rest_j, -kMaxCreated_j)
          << described(settings, "a device with passivity controller", seed) << ", " << name_of(way);
    }
  }
}

TEST(Passivity, OfPassiveLawsHoldsForSlowStrokes) {
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    if (!law.is_passive) continue;
    EXPECT_GE(least_stroke_work_j(light_rig(law.name)), -kMaxCreated_j) << law.name;
  }
}

TEST(Passivity, IsLostBySwitchingAndByDirectRendering) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    if (law.is_passive) continue;
    const HandRigSettings settings = light_rig(law.name);
    const double by_strokes_j = least_stroke_work_j(settings);
    const double by_driver_j = least_driven_j(settings, human_limits(DriverWay::kDown), seed);
    std::cout << law.name << " gave " << -1e3 * by_strokes_j << " mJ in 2.4 s of strokes, " << -1e3 * by_driver_j
              << " mJ to a driver in 2 s\n";
    // The extracted energy must be at least a hundred times the tolerance for a passive law.
    EXPECT_LT(std::min(by_strokes_j, by_driver_j), -100 * kMaxCreated_j) << law.name << ", seed " << seed;
  }
}

TEST(Passivity, OfPassiveLawsIsLostToADriverThatTurnsEveryTickWithoutAPassivityController) {
  // Without the passivity controller, a hand that changes direction as often as the force is updated can always extract
  // energy; no damping suffices.
  HandRigSettings settings = light_rig("spring-damper");
  settings.coupling.stiffness_n_per_m = 5000;
  settings.coupling.damping_n_s_per_m = 5;
  const double least_j = least_driven_j(settings, tick_limits(DriverWay::kDown), test::test_seed(kUsualSeed));
  std::cout << "spring-damper gave " << -1e3 * least_j << " mJ in 2 s\n";
  EXPECT_LT(least_j, -10 * kMaxCreated_j);
}

TEST(Saturation, ActsOnHandAndToolAlikeForEveryLaw) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    HandRigSettings settings = light_rig(law.name);
    settings.coupling.force_limit_n = 1.0;
    HandRig rig(settings, random_path(seed, 2));
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
