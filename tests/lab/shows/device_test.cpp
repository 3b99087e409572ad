// Tests every device that has a profile. Its encoders, mass and limits must not degrade the displayed force, even after
// a long free motion.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <string>
#include <vector>

#include "devices/device_profile.hpp"
#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {
namespace {

std::vector<std::string> profiles() {
  std::vector<std::string> names;
  for (const devices::DeviceProfile& profile : devices::load_device_profiles(devices::shipped_device_profiles())) {
    names.push_back(profile.name);
  }
  return names;
}

template <class Info>
std::string name_of_profile(const Info& info) {
  std::string name = info.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

Quantities held(const std::string& device, double round_trip_ms) {
  return {"users.anna.device=" + device, "link.rtt_ms=" + std::to_string(round_trip_ms)};
}

class Device : public testing::TestWithParam<std::string> {};

TEST_P(Device, FeelsTheWallWithAndWithoutDelay) {
  for (const double round_trip_ms : {0.0, 200.0}) {
    const Shown wall("wall", held(GetParam(), round_trip_ms));
    EXPECT_GE(wall["contact_force_ratio"], 0.97) << round_trip_ms;
    EXPECT_GE(wall["hold_force_ratio"], 0.97) << round_trip_ms;
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, Device, testing::ValuesIn(profiles()),
                         [](const auto& each) { return name_of_profile(each); });

// The force limit of the device inverse3 is 2 N, but the path would require a larger force. Fails if the tool at the
// server is pulled with more than the force that the device displays.
TEST(Device, OfTwoNewtonsPushesWithoutAStepAndMakesNoEnergy) {
  for (const double round_trip_ms : {0.0, 100.0}) {
    const Shown push("push", held("inverse3", round_trip_ms));
    EXPECT_LE(push["path_error_of_peak"], 0.03) << round_trip_ms;
    EXPECT_LE(push["force_step_max_n_per_ms"], 0.1) << round_trip_ms;
    EXPECT_LE(push["energy_created_max_j"], 0.002) << round_trip_ms;
  }
}

// Each client must take into account the limits of the other user's device.
TEST(Device, OfEachUserHisOwnSqueezeTogether) {
  const Shown squeeze("squeeze", {"users.anna.device=falcon", "users.ben.device=touch", "link.rtt_ms=100"});
  EXPECT_EQ(squeeze.outcome(), "completed");
  EXPECT_LE(squeeze["path_error_of_peak"], 0.1);
  EXPECT_GE(squeeze["hold_force_least_ratio"], 0.9);
}

/// Returns `path`, preceded by ten minutes of motion to and fro in free space.
devices::HandPath after_ten_minutes(const devices::HandPath& path) {
  constexpr Duration kFree = std::chrono::minutes(10), kWay = std::chrono::seconds(1);
  std::vector<devices::WayPoint> points;
  for (Duration time{0}; time < kFree; time += kWay) {
    devices::WayPoint point = path.points().front();
    const double side = points.size() % 2 == 0 ? -1 : 1;
    point.X_DH.p += side * Vec3(0.01, 0.03, 0.02) - Vec3(0.03, 0, 0);
    point.at = time;
    points.push_back(point);
  }
  for (devices::WayPoint point : path.points()) {
    point.at += kFree;
    points.push_back(point);
  }
  return devices::HandPath(std::move(points));
}

class DeviceAfterTenMinutes : public testing::TestWithParam<std::string> {};

TEST_P(DeviceAfterTenMinutes, FeelsTheWallAsAtOnce) {
  for (const double round_trip_ms : {0.0, 100.0, 200.0}) {
    const auto hold_n = [&](bool is_late) {
      Trial trial = shipped_trial("wall", held(GetParam(), round_trip_ms));
      ExperimentUser& user = trial.experiment.users.at(0);
      if (is_late) {
        user.hand = after_ten_minutes(user.hand);
        trial.experiment.duration += std::chrono::minutes(10);
      }
      const auto scene = load_experiment_scene(trial.experiment);
      return user_metric(run_virtual_session(trial.experiment, scene).users.at(0), "hold_force_mean_n");
    };
    const double at_once_n = hold_n(false);
    EXPECT_GT(at_once_n, 1) << "nothing was felt, so nothing was tested";
    EXPECT_GE(hold_n(true), 0.97 * at_once_n) << round_trip_ms;
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, DeviceAfterTenMinutes, testing::ValuesIn(profiles()),
                         [](const auto& each) { return name_of_profile(each); });

}  // namespace
}  // namespace tandem::lab
