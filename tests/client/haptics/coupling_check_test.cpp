#include "client/haptics/coupling_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "devices/device_check.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {
namespace {

using testing::HasSubstr;

/// A device of 0.1 kg with little friction. Its specified maximum stiffness is 10,000 N/m.
devices::DeviceProfile light_device() {
  devices::DeviceProfile device = devices::find_device_profile("sim");
  device.apparent_mass_kg.value = 0.1;
  device.apparent_inertia_kg_m2.value = 1e-4;
  device.physical_damping_n_s_per_m.value = 0.2;
  device.physical_damping_n_m_s_per_rad.value = 0.001;
  device.stiffness_maximum_n_per_m.value = 100000;
  return device;
}

wire::Joined joined_with(double stiffness, double damping) {
  wire::Joined joined = test::minimal_joined();
  wire::Scene& scene = *joined.mutable_scene();
  scene.mutable_coupling()->set_stiffness_n_per_m(stiffness);
  scene.mutable_coupling()->set_damping_n_s_per_m(damping);
  scene.mutable_coupling()->set_stiffness_n_m_per_rad(0.3);
  scene.mutable_coupling()->set_damping_n_m_s_per_rad(5e-4);
  wire::Tool& tool = *scene.mutable_tools(0);
  tool.set_mass_kg(0.05);
  tool.mutable_workspace()->set_position_scale(1);
  tool.mutable_workspace()->set_force_scale(1);
  return joined;
}

void set(test::SessionBench& bench, const std::string& name, double value) {
  wire::ServerControl message;
  message.mutable_parameter_set()->set_name(name);
  message.mutable_parameter_set()->set_value(value);
  bench.deliver(message);
}
void set_stiffness(test::SessionBench& bench, double value) {
  set(bench, "coupling.stiffness_n_per_m", value);
}

std::vector<haptics::StabilityFinding> findings_of(const test::SessionBench& bench,
                                                   const devices::DeviceProfile& device) {
  return explained(bench.session.coupling_check(), device);
}

constexpr std::chrono::milliseconds kMillisecond{1};
/// Polls with one new state per millisecond, so that only the coupling check can stop the force. Returns false if the
/// check has stopped the force.
bool is_displayed_for(test::SessionBench& bench, int milliseconds) {
  for (int i = 0; i < milliseconds; ++i) {
    bench.send_update();
    bench.wait(kMillisecond);
    if (!bench.scene_may_display()) return false;
  }
  return true;
}

SessionSettings with(const devices::DeviceProfile& device) {
  SessionSettings settings;
  settings.device = device;
  return settings;
}

TEST(CouplingCheck, AnUnstableCouplingIsNotDisplayedAndTheHandStillDrives) {
  test::SessionBench bench(with(light_device()));
  bench.join(joined_with(60000, 3));
  EXPECT_EQ(bench.state(), "active");
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  EXPECT_FALSE(bench.mailboxes.scene.front().may_display) << "not even for the time of a check";
  EXPECT_TRUE(bench.mailboxes.scene.front().may_drive);
  EXPECT_TRUE(bench.session.coupling_check().is_refused);
  EXPECT_THAT(bench.log, testing::Contains(HasSubstr("no force is displayed")));
  const auto findings = findings_of(bench, light_device());
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings.front().verdict, haptics::StabilityVerdict::kUnstable);
  EXPECT_EQ(findings.front().parameter, "coupling.stiffness_n_per_m");
  EXPECT_LT(findings.front().remedy, 60000);
  EXPECT_THAT(findings.front().text, HasSubstr("coupling.stiffness_n_per_m is 60000 N/m: unstable"));
}

TEST(CouplingCheck, AStableValueBringsTheForceBackWithoutANewScene) {
  test::SessionBench bench(with(light_device()));
  bench.join(joined_with(60000, 3));
  ASSERT_FALSE(bench.scene_may_display());
  const std::uint32_t generation = bench.mailboxes.scene.front().generation;
  set_stiffness(bench, findings_of(bench, light_device()).front().remedy);
  EXPECT_FALSE(bench.scene_may_display()) << "not before it was checked";
  bench.wait(CouplingWatch::kQuiet);
  EXPECT_TRUE(bench.scene_may_display());
  EXPECT_EQ(bench.mailboxes.scene.front().generation, generation) << "clutch and buttons stay as they are";
  set_stiffness(bench, 60000);
  EXPECT_TRUE(is_displayed_for(bench, 49));
  EXPECT_FALSE(is_displayed_for(bench, 1));
}

TEST(CouplingCheck, AParameterIsFeltOnceItHasBeenChecked) {
  test::SessionBench bench(with(light_device()));
  bench.join(joined_with(400, 1));
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  set_stiffness(bench, 410);
  EXPECT_FALSE(bench.mailboxes.scene.poll());
  bench.wait(CouplingWatch::kQuiet);
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  EXPECT_EQ(bench.mailboxes.scene.front().coupling.stiffness_n_per_m, 410);
}

TEST(CouplingCheck, NoHandFeelsAnUnstableCouplingThatSomebodySets) {
  test::SessionBench bench(with(light_device()));
  bench.join(joined_with(400, 1));
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  set_stiffness(bench, 60000);
  for (int i = 0; i < 300; ++i) {
    bench.send_update();
    bench.wait(kMillisecond);
    if (!bench.mailboxes.scene.poll()) continue;
    const HapticScene& felt = bench.mailboxes.scene.front();
    ASSERT_TRUE(!felt.may_display || felt.coupling.stiffness_n_per_m == 400);
  }
  EXPECT_FALSE(bench.scene_may_display());
}

TEST(CouplingCheck, ASetThatIsUnstableOnlyBetweenItsMessagesNeverCutsTheForce) {
  test::SessionBench bench(with(light_device()));
  bench.join(joined_with(100, 0));
  ASSERT_TRUE(bench.scene_may_display());
  const std::uint64_t checks = bench.session.coupling_check().number;
  // Sets a spring without damping. It is unstable, because k T/2 (stiffness k, period T) exceeds the friction of the
  // device. The check runs only after a burst of changes, so the force must continue until the next value is set.
  set_stiffness(bench, 1000);
  EXPECT_TRUE(is_displayed_for(bench, 30));
  set(bench, "coupling.damping_n_s_per_m", 3);
  EXPECT_TRUE(is_displayed_for(bench, 300));
  EXPECT_EQ(bench.session.coupling_check().number, checks + 1) << "one check for the burst";
  set(bench, "coupling.damping_n_s_per_m", 0);
  EXPECT_FALSE(is_displayed_for(bench, 60)) << "the intermediate value is unstable if it remains set";
}

TEST(CouplingCheck, AStreamOfParametersIsStillChecked) {
  test::SessionBench bench(with(light_device()));
  bench.join(joined_with(400, 1));
  int lasted_ms = 0;
  for (; lasted_ms < 1000 && is_displayed_for(bench, 1); ++lasted_ms) {
    if (lasted_ms % 10 == 0) set_stiffness(bench, 60000 + lasted_ms);
  }
  EXPECT_EQ(lasted_ms, 250);
}

TEST(CouplingCheck, NothingIsCheckedForALostConnection) {
  test::SessionBench bench(with(light_device()));
  bench.join(joined_with(400, 1));
  set_stiffness(bench, 60000);
  const std::uint64_t checks = bench.session.coupling_check().number;
  bench.session.on_disconnected(bench.now, "cut");
  bench.wait(std::chrono::milliseconds(100));
  EXPECT_EQ(bench.session.coupling_check().number, checks);
  EXPECT_FALSE(bench.scene_may_display());
}

TEST(CouplingCheck, ACouplingThatSomeHandsCouldPumpIsDisplayedWithAWarning) {
  test::SessionBench bench(with(light_device()));
  bench.join(joined_with(400, 1));
  EXPECT_TRUE(bench.scene_may_display());
  const auto findings = findings_of(bench, light_device());
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].verdict, haptics::StabilityVerdict::kNotPassive);
}

/// Adds a graspable body to the scene.
void add_body(wire::Joined& joined, double mass_kg) {
  wire::Body& body = *joined.mutable_scene()->add_bodies();
  body.set_mass_kg(mass_kg);
  body.set_graspable(true);
  *joined.add_body_masses() = test::ball_on_wire(mass_kg);
}

/// The reply of a server to a user who joins a scene with a massless tool that holds no body.
wire::Joined massless_joined() {
  wire::Joined joined = joined_with(300, 0);
  joined.mutable_scene()->mutable_coupling()->set_law("qsa-static");
  joined.mutable_scene()->mutable_coupling()->set_damping_n_m_s_per_rad(0);
  add_body(joined, 0.5);
  return joined;
}

TEST(CouplingCheck, AMasslessToolHasNoMassAndABodyThatItHoldsDoes) {
  test::SessionBench bench(with(light_device()));
  bench.join(massless_joined());
  ASSERT_EQ(bench.session.coupling_check().moved.size(), 1U);
  EXPECT_FALSE(bench.session.coupling_check().moved[0].is_held_body);
  EXPECT_TRUE(bench.scene_may_display());
  // A free tool without mass has no inertia against which the damper of the law could act. Mass, inertia and damping
  // coefficient of the loop must therefore be 0.
  const haptics::CouplingLawInfo& law = *haptics::find_coupling_law("qsa-static");
  const devices::LoopCoupling free = devices::loop_coupling(law, {}, 0.5, 1e-4);
  EXPECT_EQ(free.tool_mass_kg, 0);
  EXPECT_EQ(free.tool_inertia_kg_m2, 0);
  EXPECT_EQ(free.parameters.damping_n_s_per_m, 0);
  const devices::LoopCoupling held = devices::loop_coupling(law, {}, 0.5, 1e-4, true);
  EXPECT_EQ(held.tool_mass_kg, 0.5);
  EXPECT_EQ(held.parameters, haptics::CouplingParameters{});
  wire::ServerControl grabbed;
  grabbed.mutable_grabbed()->set_body(body_id_at(0).value);
  bench.deliver(grabbed);
  set(bench, "coupling.damping_n_s_per_m", 1);
  bench.wait(CouplingWatch::kQuiet);
  ASSERT_EQ(bench.session.coupling_check().moved.size(), 1U);
  EXPECT_TRUE(bench.session.coupling_check().moved[0].is_held_body);
  EXPECT_EQ(bench.session.coupling_check().moved[0].mass_kg, 0.5);
}

TEST(CouplingCheck, WarnsOfLawsThatAreActiveByThemselves) {
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    SCOPED_TRACE(law.name);
    wire::Joined joined = joined_with(10, 0.01);
    joined.mutable_scene()->mutable_coupling()->set_law(std::string(law.name));
    devices::DeviceProfile device = light_device();
    device.physical_damping_n_s_per_m.value = 5;  // stabilises every law, except one that generates energy
    device.physical_damping_n_m_s_per_rad.value = 0.1;
    test::SessionBench bench(with(device));
    bench.join(joined);
    EXPECT_TRUE(bench.scene_may_display());
    const auto findings = findings_of(bench, device);
    ASSERT_EQ(findings.size(), law.is_passive ? 0U : 1U);
    if (law.is_passive) continue;
    EXPECT_EQ(findings[0].verdict, haptics::StabilityVerdict::kNotPassive);
    EXPECT_EQ(findings[0].parameter, "coupling.law");
    EXPECT_THAT(findings[0].text,
                HasSubstr(law.tool == haptics::ToolDynamics::kAtHandle ? "delay" : "with any coefficients"));
  }
}

TEST(CouplingCheck, AsksOfWhatTheDeviceWouldBeAskedToRender) {
  devices::DeviceProfile device = light_device();
  device.stiffness_maximum_n_per_m.value = 500;  // a larger stiffness of a scene must be reduced to this value
  test::SessionBench bench(with(device));
  bench.join(joined_with(60000, 3));
  EXPECT_TRUE(bench.scene_may_display());
  const auto findings = findings_of(bench, device);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].rendered_value == findings[0].value, findings[0].parameter != "coupling.stiffness_n_per_m");
}

TEST(CouplingCheck, NamesTheScenesValueAndWhatThisDeviceIsGiven) {
  devices::DeviceProfile device = light_device();
  device.stiffness_maximum_n_per_m.value = 50000;
  test::SessionBench bench(with(device));
  bench.join(joined_with(60000, 3));
  const auto findings = findings_of(bench, device);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].value, 60000);
  EXPECT_EQ(findings[0].rendered_value, 50000);
  EXPECT_LT(findings[0].remedy, 50000);
  EXPECT_THAT(findings[0].text,
              HasSubstr("coupling.stiffness_n_per_m is 60000 N/m in the scene, 50000 N/m on this device: unstable"));
}

TEST(CouplingCheck, ReportsThatItDependsOnUnverifiedNumbers) {
  devices::DeviceProfile device = light_device();
  test::SessionBench bench(with(device));
  bench.join(joined_with(60000, 3));
  EXPECT_THAT(findings_of(bench, device)[0].text, testing::Not(HasSubstr("verified")));
  device.apparent_mass_kg.source = "unverified: a guess";
  EXPECT_THAT(findings_of(bench, device)[0].text, HasSubstr("unverified values"));
}

TEST(CouplingCheck, VelocityIsTakenOverATimeByEachEncodersOwnSteps) {
  devices::DeviceProfile device = light_device();
  device.position_step_m.value = 1e-5;
  device.rotation_step_rad.value = 0;
  EXPECT_EQ(devices::loop_device(device).velocity_window, 4);
  EXPECT_EQ(devices::loop_device(device).rotational_velocity_window, 1);
  std::swap(device.position_step_m, device.rotation_step_rad);
  device.rate_hz = 3000;
  EXPECT_EQ(devices::loop_device(device).velocity_window, 1);
  EXPECT_EQ(devices::loop_device(device).rotational_velocity_window, 12);
  device.rate_hz = 100;
  EXPECT_EQ(devices::loop_device(device).rotational_velocity_window, 1);
}

TEST(CouplingCheck, QuickVerdictIsThatOfTheFindings) {
  Random random(31, 0);
  int refused = 0;
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE("seed 31, scene " + std::to_string(i));
    CouplingCheck check;
    check.number = 1;
    check.scene.law = static_cast<std::size_t>(random.uniform() * static_cast<double>(haptics::coupling_laws().size()));
    check.scene.coupling.stiffness_n_per_m = 20 * std::pow(5000.0, random.uniform());
    check.scene.coupling.damping_n_s_per_m = 0.02 * std::pow(1000.0, random.uniform());
    const double mass_kg = 0.02 + random.uniform();
    check.moved = {{mass_kg, mass_kg * 2e-4, random.uniform() < 0.5}};
    const auto findings = explained(check, light_device());
    const bool is_unstable =
        std::any_of(findings.begin(), findings.end(), [](const haptics::StabilityFinding& finding) {
          return finding.verdict == haptics::StabilityVerdict::kUnstable;
        });
    EXPECT_EQ(is_stable_coupling(check.scene, check.moved, light_device()), !is_unstable);
    refused += is_unstable ? 1 : 0;
  }
  EXPECT_GT(refused, 5);
  EXPECT_LT(refused, 35);
}

TEST(CouplingCheck, SeesTheSceneThroughTheWorkspaceMapping) {
  test::SessionBench bench(with(light_device()));
  wire::Joined joined = joined_with(60000, 3);
  // With a force scale of 0.01, stiffness, damping and mass at the device are a hundredth of those in the scene. The
  // scene's 60,000 N/m are only 600 N/m for the user.
  joined.mutable_scene()->mutable_tools(0)->mutable_workspace()->set_force_scale(0.01);
  joined.mutable_scene()->mutable_coupling()->set_damping_n_s_per_m(100);
  bench.join(joined);
  EXPECT_TRUE(bench.scene_may_display());
}

TEST(CouplingCheck, ChecksNothingForAnObserverOrWithoutADevice) {
  SessionSettings watching = with(light_device());
  watching.role = wire::ROLE_OBSERVER;
  test::SessionBench observer(watching);
  wire::Joined joined = joined_with(60000, 3);
  joined.set_role(wire::ROLE_OBSERVER);
  observer.join(joined);
  EXPECT_EQ(observer.session.coupling_check().number, 0U);
  EXPECT_FALSE(observer.scene_may_display());
  test::SessionBench unknown;
  unknown.join(joined_with(60000, 3));
  set_stiffness(unknown, 60000);
  unknown.wait(CouplingWatch::kAtLatest);
  EXPECT_EQ(unknown.session.coupling_check().number, 0U);
  EXPECT_TRUE(unknown.scene_may_display());
}

TEST(CouplingCheck, IsOfTheLightestAndTheHeaviestThatTheToolCouldMove) {
  const auto masses = [](const wire::Joined& joined, std::string_view law, BodyId held) {
    std::vector<double> result;
    for (const physics::MovedMass& thing : things_to_move(joined, *haptics::find_coupling_law(law), held)) {
      result.push_back(thing.mass_kg);
    }
    return result;
  };
  wire::Joined joined = joined_with(300, 3);
  EXPECT_THAT(masses(joined, "spring-damper", BodyId{}), testing::ElementsAre(0.05));
  for (const double mass_kg : {0.0, 0.01, 2.0, 0.3}) add_body(joined, mass_kg);
  joined.mutable_scene()->add_bodies()->set_mass_kg(50);  // not graspable, so it is not checked
  EXPECT_THAT(masses(joined, "spring-damper", BodyId{}), testing::ElementsAre(0.05, 0.01, 2.0));
  EXPECT_THAT(masses(joined, "spring-damper", body_id_at(3)), testing::ElementsAre(0.05, 0.01, 2.0));
  // The adaptive law has coefficients for the currently moved mass only, so no other mass is checked.
  EXPECT_THAT(masses(joined, "adaptive", BodyId{}), testing::ElementsAre(0.05));
  EXPECT_THAT(masses(joined, "adaptive", body_id_at(3)), testing::ElementsAre(0.3));
}

TEST(CouplingCheck, MassesThatAreMissingOrOfNoUseDisplayNothing) {
  std::vector<wire::Joined> useless(6, joined_with(400, 1));
  useless[0].clear_tool_masses();
  useless[1].mutable_tool_masses(0)->set_principal_inertia_kg_m2(1, 1e9);
  useless[2].mutable_tool_masses(0)->clear_centre();
  useless[3].mutable_tool_masses(0)->set_principal_inertia_kg_m2(0, 0);
  useless[4].mutable_tool_masses(0)->set_centre(3, 2);
  add_body(useless[5], 0.1);
  useless[5].mutable_body_masses(0)->set_mass_kg(-1);
  for (const wire::Joined& joined : useless) {
    SCOPED_TRACE(joined.ShortDebugString());
    test::SessionBench bench(with(light_device()));
    bench.join(joined);
    EXPECT_FALSE(bench.scene_may_display());
    EXPECT_TRUE(bench.mailboxes.scene.front().may_drive);
    const auto findings = findings_of(bench, light_device());
    ASSERT_EQ(findings.size(), 1U);
    EXPECT_EQ(findings[0].verdict, haptics::StabilityVerdict::kUnstable);
    EXPECT_THAT(findings[0].text, HasSubstr("no usable mass"));
  }
}

TEST(CouplingCheck, ABodyCountsWhereTheStateSaysThatItIsHeld) {
  test::SessionBench bench(with(light_device()));
  wire::Joined joined = joined_with(400, 1);
  add_body(joined, 0.5);
  bench.join(joined);
  const double about_centre = 0.5 * 0.015 * 0.015;
  EXPECT_NEAR(bench.session.coupling_check().moved.back().inertia_kg_m2, about_centre, 1e-9)
      << "the grasped point is unknown, so the inertia about the centre counts";
  const auto hold_at = [&bench](const Vec3& p_BT) {
    proto::ServerUpdate update = bench.next_update();
    update.held_body = body_id_at(0);
    update.X_BT.p = p_BT;
    bench.session.on_datagram(bench.datagram_of(update), bench.now);
  };
  wire::ServerControl grabbed;
  grabbed.mutable_grabbed()->set_body(body_id_at(0).value);
  bench.deliver(grabbed);
  hold_at({0.1, 0, 0});
  bench.wait(CouplingWatch::kQuiet);
  EXPECT_NEAR(bench.session.coupling_check().moved.back().inertia_kg_m2, about_centre + 0.5 * 0.1 * 0.1, 1e-6);
  const std::uint64_t checks = bench.session.coupling_check().number;
  hold_at({0.102, 0, 0});
  bench.wait(CouplingWatch::kAtLatest);
  EXPECT_EQ(bench.session.coupling_check().number, checks) << "a grip that slips a little is no other one";
  hold_at({0.05, 0, 0});
  bench.wait(CouplingWatch::kQuiet);
  EXPECT_NEAR(bench.session.coupling_check().moved.back().inertia_kg_m2, about_centre + 0.5 * 0.05 * 0.05, 1e-6);
}

}  // namespace
}  // namespace tandem::client
