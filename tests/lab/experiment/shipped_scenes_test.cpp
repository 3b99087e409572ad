// Checks the shipped experiments against the table below, without running them. Hands must have the phases that metrics
// evaluate, and move at the stated speeds. Scenes must be loadable, and the simulated device must be able to display
// their coupling.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "devices/device_check.hpp"
#include "lab/experiment/experiment.hpp"
#include "server/assets/scene_file.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::lab {
namespace {

using std::chrono::milliseconds;

constexpr std::array kShipped = {"free",
                                 "wall",
                                 "curve",
                                 "rim",
                                 "bunny",
                                 "push",
                                 "mass",
                                 "squeeze",
                                 "squeeze_slippery",
                                 "peg",
                                 "soft",
                                 "docking",
                                 "carry_along",
                                 "carry_along_fast",
                                 "carry_across",
                                 "carry_across_fast",
                                 "tug_of_war",
                                 "turn_together",
                                 "two_blocks",
                                 "three_hands",
                                 "four_hands",
                                 "two_carry",
                                 "turn_squeezed",
                                 "two_plates",
                                 "box_on_box"};
/// Names of the phases that metrics evaluate. A phase with another name, e.g. a misspelt one, would not be evaluated.
constexpr std::array kPhases = {"approach", "move", "contact", "slide", "shake", "hold", "retreat"};

Experiment shipped(const std::string& name) {
  return load_experiment(test::source_path("lab/experiments") / (name + ".json"));
}

std::string phase_at(const devices::HandPath& path, Duration time) {
  const int phase = path.phase_at(time);
  return phase < 0 ? "" : path.phases().at(static_cast<std::size_t>(phase));
}

/// Returns times within a phase at intervals of one millisecond.
std::vector<Duration> times_of(const devices::HandPath& path, const std::string& phase) {
  std::vector<Duration> times;
  for (Duration time{0}; time < path.length(); time += milliseconds(1)) {
    if (phase_at(path, time) == phase) times.push_back(time);
  }
  return times;
}

double greatest_speed(const devices::HandPath& path, const std::string& phase) {
  double greatest = 0;
  for (const Duration time : times_of(path, phase)) greatest = std::max(greatest, path.twist_at(time).v.norm());
  return greatest;
}

class ShippedExperiment : public testing::TestWithParam<const char*> {};

TEST_P(ShippedExperiment, LastsEightSecondsAndTheHandsGetToTheEndOfTheirPaths) {
  const Experiment experiment = shipped(GetParam());
  EXPECT_EQ(experiment.name, GetParam());
  EXPECT_GE(experiment.duration, from_seconds(8));
  for (const ExperimentUser& user : experiment.users) EXPECT_LE(user.hand.length(), experiment.duration) << user.name;
}

TEST_P(ShippedExperiment, HasOnlyPhasesThatMetricsKnowAndBeginsWithTheApproach) {
  for (const ExperimentUser& user : shipped(GetParam()).users) {
    EXPECT_EQ(phase_at(user.hand, Duration(0)), "approach") << user.name;
    for (const std::string& phase : user.hand.phases()) EXPECT_THAT(kPhases, testing::Contains(phase)) << user.name;
  }
}

TEST_P(ShippedExperiment, HoldsStillForThreeSecondsInOnePiece) {
  for (const ExperimentUser& user : shipped(GetParam()).users) {
    const std::vector<Duration> times = times_of(user.hand, "hold");
    ASSERT_GE(times.size(), 3000U) << user.name;
    EXPECT_EQ(times.back() - times.front(), milliseconds(static_cast<int>(times.size()) - 1)) << user.name;
    for (const Duration time : times) ASSERT_EQ(user.hand.twist_at(time).v.norm(), 0) << user.name;
  }
}

TEST_P(ShippedExperiment, HasACouplingThatTheSimulatedDeviceCanShowWithWhateverItMoves) {
  const Experiment experiment = shipped(GetParam());
  const auto scene = load_experiment_scene(experiment);
  ASSERT_GE(scene->world.tools.size(), experiment.users.size());
  const haptics::CouplingLawInfo* law = haptics::find_coupling_law(scene->world.coupling.law);
  ASSERT_NE(law, nullptr);
  for (std::size_t tool = 0; tool < scene->world.tools.size(); ++tool) {
    std::vector<physics::MovedMass> moved{server::moved_mass(*scene, tool, std::nullopt)};
    for (std::size_t body = 0; body < scene->world.bodies.size(); ++body) {
      if (scene->description.bodies(static_cast<int>(body)).graspable())
        moved.push_back(server::moved_mass(*scene, tool, body));
    }
    const devices::DeviceProfile device = devices::find_device_profile("sim");
    for (const physics::MovedMass& each : moved) {
      const devices::LoopCoupling loop =
          devices::loop_coupling(*law, physics::coupling_in_force(scene->world.coupling, each), each.mass_kg,
                                 each.inertia_kg_m2, each.is_held_body);
      EXPECT_TRUE(haptics::is_stable_coupling(loop.parameters, loop.tool_mass_kg, loop.tool_inertia_kg_m2,
                                              devices::loop_device(device, scene->workspaces[tool]),
                                              loop.slope_factor));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedExperiment, testing::ValuesIn(kShipped),
                         [](const auto& experiment) { return std::string(experiment.param); });

TEST(ShippedPaths, FreeReachesThirtyCentimetresASecond) {
  EXPECT_NEAR(greatest_speed(shipped("free").users.at(0).hand, "move"), 0.3, 0.001);
}

TEST(ShippedPaths, DockingMovesAtFiftyMillimetresASecond) {
  const devices::HandPath path = shipped("docking").users.at(1).hand;
  for (const char* phase : {"move", "contact", "slide"}) EXPECT_NEAR(greatest_speed(path, phase), 0.05, 0.003) << phase;
}

// The hand intends a circle inside the ball, so the tool is pressed against the ball. The tool's centre is on the line
// from the ball's centre through the intended point, 25 mm from the ball's centre (the sum of the radii of ball and
// tip). The test computes the speed of the tool at this distance.
TEST(ShippedPaths, CurveLeadsTheToolRoundTheBallAtTenCentimetresASecond) {
  const Experiment experiment = shipped("curve");
  const auto scene = load_experiment_scene(experiment);
  const devices::HandPath& path = experiment.users.at(0).hand;
  const Vec3 start = scene->world.tools.at(0).X_WT.p;
  const Duration later = milliseconds(1);
  for (Duration time = milliseconds(3200); time < milliseconds(6900); time += milliseconds(50)) {
    const Vec3 here = 0.025 * (start + path.pose_at(time).p).normalized();
    const Vec3 there = 0.025 * (start + path.pose_at(time + later).p).normalized();
    EXPECT_NEAR((there - here).norm() / to_seconds(later), 0.1, 0.002) << to_seconds(time);
  }
}

// Expected force: hand and coupling are two springs in series, stretched by the distance between the intended position
// and the contact.
TEST(ShippedPaths, SqueezePressesWithThreePointSixNewtonsFromEachSide) {
  const Experiment experiment = shipped("squeeze");
  const auto scene = load_experiment_scene(experiment);
  const double half_cube = scene->description.bodies(1).shapes(0).box().size_m(1) / 2;
  for (std::size_t i = 0; i < 2; ++i) {
    const ExperimentUser& user = experiment.users.at(i);
    const double half_finger = scene->description.tools(static_cast<int>(i)).shapes(0).box().size_m(1) / 2;
    const Vec3 start = scene->world.tools.at(i).X_WT.p;
    const double side = start.y() < 0 ? 1 : -1;
    const double hand = user.hand_parameters.stiffness_n_per_m;
    const double coupling = scene->world.coupling.parameters.stiffness_n_per_m;
    const double stiffness = 1 / (1 / hand + 1 / coupling);
    for (const Duration time : times_of(user.hand, "hold")) {
      const double past_contact = side * (start.y() + user.hand.pose_at(time).p.y()) + half_cube + half_finger;
      ASSERT_NEAR(stiffness * past_contact, 3.6, 0.01) << user.name;
    }
  }
}

TEST(ShippedPaths, SqueezeAndItsSlipperySisterDifferInFrictionAlone) {
  const auto rough = load_experiment_scene(shipped("squeeze"));
  const auto slippery = load_experiment_scene(shipped("squeeze_slippery"));
  wire::Scene same = slippery->description;
  EXPECT_EQ(same.bodies(1).friction(), 0.5);
  same.mutable_bodies(1)->set_friction(rough->description.bodies(1).friction());
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(same.tools(i).friction(), 0.5);
    same.mutable_tools(i)->set_friction(rough->description.tools(i).friction());
  }
  EXPECT_EQ(same.SerializeAsString(), rough->description.SerializeAsString());
}

}  // namespace
}  // namespace tandem::lab
