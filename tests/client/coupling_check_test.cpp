#include "client/coupling_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "common/coupling/laws.hpp"
#include "common/json/fields.hpp"
#include "server/scene_file.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem {
namespace {

namespace json = boost::json;
using testing::HasSubstr;

/// A device of its own: 0.1 kg, a little friction, good for 10,000 N/m by its maker's word.
DeviceProfile light_device() {
  DeviceProfile device = find_device_profile("sim");
  device.apparent_mass_kg.value = 0.1;
  device.apparent_inertia_kg_m2.value = 1e-4;
  device.physical_damping_n_s_per_m.value = 0.2;
  device.physical_damping_n_m_s_per_rad.value = 0.001;
  device.stiffness_maximum_n_per_m.value = 100000;
  return device;
}

wire::Joined joined_with(double stiffness, double damping) {
  wire::Joined joined = minimal_joined();
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

void set_stiffness(SessionBench& bench, double value) {
  wire::ServerControl message;
  message.mutable_parameter_set()->set_name("coupling.stiffness_n_per_m");
  message.mutable_parameter_set()->set_value(value);
  bench.say(message);
}

SessionSettings with(const DeviceProfile& device) {
  SessionSettings settings;
  settings.device = device;
  return settings;
}

TEST(CouplingCheck, AnUnstableCouplingIsNotDisplayedAndTheSessionGoesOn) {
  SessionBench bench(with(light_device()));
  bench.join(joined_with(60000, 3));
  EXPECT_EQ(bench.state(), "active");
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  EXPECT_FALSE(bench.mailboxes.scene.front().may_display);
  ASSERT_FALSE(bench.session.coupling_findings().empty());
  const StabilityFinding& finding = bench.session.coupling_findings().front();
  EXPECT_EQ(finding.verdict, StabilityVerdict::kUnstable);
  EXPECT_EQ(finding.parameter, "coupling.stiffness_n_per_m");
  EXPECT_LT(finding.remedy, 60000);
  EXPECT_THAT(bench.log, testing::Contains(HasSubstr("coupling.stiffness_n_per_m is 6e+04 N/m: unstable")));
}

TEST(CouplingCheck, AStableValueBringsTheForceBackThroughTheRamp) {
  SessionBench bench(with(light_device()));
  bench.join(joined_with(60000, 3));
  ASSERT_FALSE(bench.scene_may_display());
  const std::uint32_t generation = bench.mailboxes.scene.front().generation;
  set_stiffness(bench, bench.session.coupling_findings().front().remedy);
  EXPECT_TRUE(bench.scene_may_display());
  EXPECT_EQ(bench.mailboxes.scene.front().generation, generation + 1);
  set_stiffness(bench, 60000);
  EXPECT_FALSE(bench.scene_may_display());
}

TEST(CouplingCheck, ACouplingThatSomeHandsCouldPumpIsDisplayedWithAWarning) {
  SessionBench bench(with(light_device()));
  bench.join(joined_with(400, 1));
  EXPECT_TRUE(bench.scene_may_display());
  ASSERT_EQ(bench.session.coupling_findings().size(), 1U);
  EXPECT_EQ(bench.session.coupling_findings()[0].verdict, StabilityVerdict::kNotPassive);
}

TEST(CouplingCheck, AsksOfWhatTheDeviceWouldBeAskedToRender) {
  DeviceProfile device = light_device();
  device.stiffness_maximum_n_per_m.value = 500;  // more is never displayed, whatever the scene says
  SessionBench bench(with(device));
  bench.join(joined_with(60000, 3));
  EXPECT_TRUE(bench.scene_may_display());
}

TEST(CouplingCheck, SeesTheSceneThroughTheWorkspaceMapping) {
  SessionBench bench(with(light_device()));
  wire::Joined joined = joined_with(60000, 3);
  // A hundredth of the stiffness reaches the hand, and of the damping, and of the tool's mass.
  joined.mutable_scene()->mutable_tools(0)->mutable_workspace()->set_force_scale(0.01);
  joined.mutable_scene()->mutable_coupling()->set_damping_n_s_per_m(100);
  bench.join(joined);
  EXPECT_TRUE(bench.scene_may_display());
}

TEST(CouplingCheck, AsksNothingForAnObserverNorWithoutADevice) {
  SessionSettings watching = with(light_device());
  watching.role = wire::ROLE_OBSERVER;
  SessionBench observer(watching);
  wire::Joined joined = joined_with(60000, 3);
  joined.set_role(wire::ROLE_OBSERVER);
  observer.join(joined);
  EXPECT_TRUE(observer.session.coupling_findings().empty());
  EXPECT_FALSE(observer.scene_may_display());
  SessionBench unknown;
  unknown.join(joined_with(60000, 3));
  EXPECT_TRUE(unknown.session.coupling_findings().empty());
  EXPECT_TRUE(unknown.scene_may_display());
}

TEST(CouplingCheck, IsOfTheLightestAndTheHeaviestThatTheToolCouldMove) {
  wire::Joined joined = joined_with(300, 3);
  EXPECT_EQ(tool_masses(joined).low_kg, 0.05);
  EXPECT_EQ(tool_masses(joined).high_kg, 0.05);
  for (const double mass : {0.0, 0.01, 2.0}) {
    wire::Body& body = *joined.mutable_scene()->add_bodies();
    body.set_mass_kg(mass);
    body.set_graspable(true);
  }
  joined.mutable_scene()->add_bodies()->set_mass_kg(50);  // cannot be grabbed
  EXPECT_EQ(tool_masses(joined).low_kg, 0.01);
  EXPECT_EQ(tool_masses(joined).high_kg, 2.0);
  joined.set_tool(7);
  EXPECT_EQ(tool_masses(joined).high_kg, 0);
}

/// The scene's masses, couplings and workspaces; its shapes do not matter here and take long to load.
std::string without_shapes(const std::filesystem::path& file) {
  const json::value scene = parse_json(read_text_file(file), file.string());
  json::object bare{{"name", scene.at("name")}};
  if (scene.as_object().contains("coupling")) bare["coupling"] = scene.at("coupling");
  for (const char* list : {"bodies", "tools"}) {
    json::array& things = bare.emplace(list, json::array()).first->value().as_array();
    for (const json::value& thing : scene.at(list).as_array()) {
      json::object& copy = things.emplace_back(json::object()).as_object();
      for (const char* field : {"name", "mass_kg", "graspable", "workspace"}) {
        if (thing.as_object().contains(field)) copy[field] = thing.at(field);
      }
      if (std::string_view(list) == "bodies") {
        copy["shapes"] = json::array{json::object{{"box", json::object{{"size_m", {0.02, 0.02, 0.02}}}}}};
      }
    }
  }
  return json::serialize(bare);
}

TEST(CouplingCheck, NoShippedSceneIsRefusedOnTheSimulatedDevice) {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(TANDEM_SCENES)) {
    if (entry.path().extension() != ".json") continue;
    SCOPED_TRACE(entry.path().string());
    const auto scene = load_scene_text(without_shapes(entry.path()), "scene", ".");
    for (int tool = 0; tool < scene->description.tools_size(); ++tool) {
      wire::Joined joined = minimal_joined();
      *joined.mutable_scene() = scene->description;
      joined.set_tool(static_cast<std::uint32_t>(tool));
      SessionBench bench(with(find_device_profile("sim")));
      bench.join(joined);
      EXPECT_EQ(bench.state(), "active") << bench.session.status().why;
      EXPECT_TRUE(bench.scene_may_display());
      EXPECT_THAT(bench.session.coupling_findings(), testing::IsEmpty());
    }
    ++scenes;
  }
  EXPECT_GE(scenes, 6);
}

}  // namespace
}  // namespace tandem
