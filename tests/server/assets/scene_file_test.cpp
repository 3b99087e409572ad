// Scene files are written by hand, and the server relies on their contents. Each mistake must be refused with a message
// that names the faulty field.
#include "server/assets/scene_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>

#include <sys/stat.h>

#include "common/haptics/coupling/laws.hpp"
#include "proto/placement.hpp"
#include "proto/state.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string refusal_of(const std::string& json) {
  try {
    load_scene_text(json, "peg.json", "/nowhere");
  } catch (const SceneError& error) {
    return error.what();
  }
  return "accepted";
}

std::string repeated(const std::string& text, std::size_t count) {
  std::string result;
  for (std::size_t i = 0; i < count; ++i) result += (i == 0 ? "" : ",") + text;
  return result;
}

struct BadScene {
  const char* name;
  std::string json;
  std::vector<std::string> expected;  ///< substrings that the error message must contain
};
void PrintTo(const BadScene& scene, std::ostream* os) {
  *os << scene.name;
}

std::string with_shape(const std::string& shape) {
  return physics::scene_json({.bodies = R"({"name": "a", "shapes": [)" + shape + "]}"});
}
std::string with_body(const std::string& fields) {
  return physics::scene_json(
      {.bodies = R"({"name": "a", "shapes": [{"sphere": {"radius_m": 0.01}}], )" + fields + "}"});
}
std::string with_tool(const std::string& fields) {
  return physics::scene_json({.tools = R"({"name": "t", )" + fields + "}"});
}
std::string with(const std::string& fields) {
  return physics::scene_json({.coupling = "", .rest = fields});
}

std::string with_fit(const std::string& fields) {
  return with(R"("coupling": {"law": "adaptive", "adaptive": {)" + fields + "}}");
}

std::vector<BadScene> bad_bodies() {
  const std::string ball = R"({"name": "ball", "shapes": [{"sphere": {"radius_m": 0.01}}], "mass_kg": 0.1)";
  return {
      {"Empty", "", {"peg.json: line 1:", "not a scene in JSON"}},
      {"MissingComma", "{\n \"name\": \"s\"\n \"bodies\": []\n}", {"peg.json: line 3:", "Expected , or }"}},
      {"CutOff", "{\n\"bodies\": [\n", {"line 3:", "Unexpected end"}},
      {"UnknownField", with_body(R"("mas_kg": 1)"), {"bodies[0].mas_kg", "is not a field of a scene"}},
      {"FieldOfTwoLines", with_body(R"("mas\nkg": 1)"), {"mas?kg"}},
      {"WrongType", with_body(R"("mass_kg": "heavy")"), {"bodies[0].mass_kg", "heavy"}},
      {"NoName", R"({"bodies": [], "tools": []})", {"peg.json: name is empty"}},
      {"NoBodies", physics::scene_json({.bodies = ""}), {"bodies is empty"}},
      {"NoTools", physics::scene_json({.tools = ""}), {"tools is empty"}},
      {"SameNames",
       physics::scene_json({.bodies = ball + "}," + ball + "}"}),
       {"bodies[1].name is \"ball\"", "unique"}},
      {"NamelessBody",
       physics::scene_json({.bodies = R"({"shapes": [{"sphere": {"radius_m": 1}}]})"}),
       {"bodies[0].name is empty"}},
      {"NoShapes", physics::scene_json({.bodies = R"({"name": "a"})"}), {"bodies[0].shapes is empty"}},
      {"ShapeWithoutKind", with_shape("{}"), {"bodies[0].shapes[0] has no kind", "sphere"}},
      {"ZeroRadius",
       with_shape(R"({"sphere": {"radius_m": 0}})"),
       {"peg.json: bodies[0].shapes[0].sphere.radius_m is 0 m; it must be from 1e-06 to 100 m"}},
      {"NanRadius", with_shape(R"({"sphere": {"radius_m": "NaN"}})"), {"sphere.radius_m is nan"}},
      {"FlatBox", with_shape(R"({"box": {"size_m": [1, 2]}})"), {"shapes[0].box.size_m has 2 numbers", "must have 3"}},
      {"NegativeBox", with_shape(R"({"box": {"size_m": [1, 2, -3]}})"), {"box.size_m[2] is -3"}},
      {"InfiniteCylinder",
       with_shape(R"({"cylinder": {"radius_m": 1, "length_m": "Infinity"}})"),
       {"cylinder.length_m is inf"}},
      {"CapsuleWithoutLength", with_shape(R"({"capsule": {"radius_m": 1}})"), {"capsule.length_m is 0"}},
      {"NegativeMass",
       with_body(R"("mass_kg": -1)"),
       {"peg.json: bodies[0].mass_kg is -1 kg; it must be from 1e-06 to 10000 kg, or 0 (static)"}},
      {"NegativeFriction", with_body(R"("friction": -0.1)"), {"bodies[0].friction is -0.1"}},
      {"Bouncier", with_body(R"("restitution": 1.5)"), {"bodies[0].restitution is 1.5", "from 0 to 1"}},
      {"TwoColours", with_body(R"("color_rgb": [1, 0])"), {"bodies[0].color_rgb has 2 numbers"}},
      {"GlaringColour", with_body(R"("color_rgb": [1, 255, 0])"), {"bodies[0].color_rgb[1] is 255"}},
      {"FlatPlacement",
       with_body(R"("placement": {"position_m": [1, 2]})"),
       {"bodies[0].placement.position_m has 2 numbers; it must have 3"}},
      {"NanPlacement",
       with_body(R"("placement": {"rotation_xyz_deg": [0, "NaN", 0]})"),
       {"bodies[0].placement.rotation_xyz_deg[1] is nan °; it must be from -360 to 360 °"}},
      {"GraspableWall", with_body(R"("graspable": true)"), {"bodies[0].graspable is true", "static"}},
      {"AnchoredWall", with_body(R"("anchor": {})"), {"bodies[0].anchor is given", "static"}},
      {"RigidAnchor",
       with_body(R"("mass_kg": 1, "anchor": {"stiffness_n_per_m": 2e5})"),
       {"bodies[0].anchor.stiffness_n_per_m is 200000"}},
      {"AnchorThatDrives",
       with_body(R"("mass_kg": 1, "anchor": {"damping_n_m_s_per_rad": -1})"),
       {"bodies[0].anchor.damping_n_m_s_per_rad is -1"}},
      {"HeavierThanAllByAHair",
       with_body(R"("mass_kg": 10000.000000000002)"),
       {"bodies[0].mass_kg is 10000.000000000002 kg; it must be from 1e-06 to 10000 kg"}},
      {"MissingMesh",
       with_shape(R"({"mesh": {"file": "/x/y.obj"}})"),
       {"bodies[0].shapes[0].mesh.file is /x/y.obj, which does not exist"}},
      {"MissingDataPackage",
       with_shape(R"({"mesh": {"file": "/usr/share/glmark2/none.obj"}})"),
       {"none.obj, which does not exist; install Debian package glmark2-data"}},
      {"RelativeMesh", with_shape(R"({"mesh": {"file": "m/y.obj"}})"), {"is /nowhere/m/y.obj, which does not exist"}},
      {"NamelessMesh", with_shape(R"({"mesh": {}})"), {"mesh.file is empty"}},
      {"TwoScales",
       with_shape(R"({"mesh": {"file": "a.obj", "scale": 2, "largest_size_m": 1}})"),
       {"mesh has both scale and largest_size_m"}},
      {"MissingMolecule",
       with_shape(R"({"molecule": {"file": "/usr/share/pymol/none.pdb"}})"),
       {"molecule.file is /usr/share/pymol/none.pdb, which does not exist; install Debian package pymol-data"}},
      {"MoleculeInCompany",
       with_shape(R"({"molecule": {"file": "a.pdb"}}, {"sphere": {"radius_m": 1}})"),
       {"shapes[0].molecule is one of several shapes"}},
      {"ShiftedMolecule",
       with_shape(R"({"molecule": {"file": "a.pdb"}, "placement": {"position_m": [0, 0, 1]}})"),
       {"shapes[0].placement is not zero", "place the body"}},
  };
}

std::vector<BadScene> bad_tools_and_settings() {
  const std::string ball = R"({"name": "ball", "shapes": [{"sphere": {"radius_m": 0.01}}], "mass_kg": 0.1)";
  return {
      {"MoleculeTool", with_tool(R"("shapes": [{"molecule": {"file": "a.pdb"}}])"), {"tools[0].shapes[0].molecule"}},
      {"HoldsNobody", with_tool(R"("holds": "cup")"), {"tools[0].holds is \"cup\"; there is no body of that name"}},
      {"HoldsWall", with_tool(R"("holds": "wall")"), {"tools[0].holds is \"wall\", which is static"}},
      {"HoldsUngraspable",
       physics::scene_json({.bodies = ball + "}", .tools = R"({"name": "t", "holds": "ball"})"}),
       {"tools[0].holds is \"ball\", which is not graspable"}},
      {"WeightlessTool", with_tool(R"("mass_kg": 0)"), {"tools[0].mass_kg is 0"}},
      {"NoScaling", with_tool(R"("workspace": {"position_scale": 0})"), {"tools[0].workspace.position_scale is 0"}},
      {"UnknownLaw",
       with(R"("coupling": {"law": "rubber"})"),
       {"coupling.law is \"rubber\"", "stable-dynamic", "spring-damper", "direct"}},
      {"NegativeStiffness", with(R"("coupling": {"stiffness_n_per_m": -1})"), {"coupling.stiffness_n_per_m is -1"}},
      {"SaturationBeyondAll",
       with(R"("coupling": {"saturation_softness": 1.1})"),
       {"coupling.saturation_softness is 1.1", "from 0 to 1"}},
      {"BluntCurve",
       with(R"("coupling": {"curve_sharpness": 0})"),
       {"coupling.curve_sharpness is 0", "from 0.1 to 10"}},
      {"FitOfAnotherLaw",
       with(R"("coupling": {"law": "direct", "adaptive": {"mass_range_kg": [0, 1]}})"),
       {"coupling.adaptive is given", "\"direct\"", "\"adaptive\""}},
      {"AdaptiveWithoutAFit",
       with(R"("coupling": {"law": "adaptive"})"),
       {"peg.json: coupling.adaptive is missing", "tandem-lab calibrate --device NAME", "mass_range_kg", "16.21"}},
      {"FitWithoutRange", with_fit(R"("stiffness_n_per_m": [1])"), {"coupling.adaptive.mass_range_kg has 0 numbers"}},
      {"FitOfNoMass",
       with_fit(R"("mass_range_kg": [0.2, 0.1], "stiffness_n_per_m": [1], "damping_n_s_per_m": [1])"),
       {"coupling.adaptive.mass_range_kg is 0.2 to 0.1"}},
      {"FitOfTooHighADegree",
       with_fit(R"("mass_range_kg": [0, 1], "stiffness_n_per_m": [1, 2, 3, 4, 5], "damping_n_s_per_m": [1])"),
       {"coupling.adaptive.stiffness_n_per_m has 5 coefficients; it must have 1 to 4"}},
      {"FitThatDips",
       with_fit(R"("mass_range_kg": [0, 1], "stiffness_n_per_m": [1, -3, 2.2], "damping_n_s_per_m": [1])"),
       {"coupling.adaptive.stiffness_n_per_m gives -", "over the whole range"}},
      {"HalfOfARotation",
       with_fit(R"("mass_range_kg": [0, 1], "stiffness_n_per_m": [1], "damping_n_s_per_m": [1],
                   "stiffness_n_m_per_rad": [1])"),
       {"coupling.adaptive.stiffness_n_m_per_rad is given without inertia_range_kg_m2"}},
      {"ZeroForceLimit", with(R"("coupling": {"force_limit_n": 0})"), {"coupling.force_limit_n is 0"}},
      {"StifferThanTheWire",
       with(R"("coupling": {"stiffness_n_per_m": 2e5})"),
       {"coupling.stiffness_n_per_m is 200000"}},
      {"SoftTool", with_tool(R"("contact_stiffness_n_per_m3": 1)"), {"tools[0].contact_stiffness_n_per_m3 is 1"}},
      {"FewContactPoints", with(R"("limits": {"contact_points": 10})"), {"limits.contact_points is 10", "256"}},
      {"NoContactPairs", with(R"("limits": {"contact_pairs": 0})"), {"limits.contact_pairs is 0"}},
      {"TooSlow", with(R"("step_rate_hz": 59)"), {"step_rate_hz is 59 Hz; it must be from 60 to 4000 Hz"}},
      {"TooFast", with(R"("step_rate_hz": 4001)"), {"step_rate_hz is 4001"}},
      {"FlatGravity", with(R"("gravity_m_per_s2": [0, 0])"), {"gravity_m_per_s2 has 2 numbers"}},
      {"ZeroMolecularScale",
       with(R"("molecular_field": {"metres_per_angstrom": 0})"),
       {"molecular_field.metres_per_angstrom is 0"}},
      {"Dielectric",
       with(R"("molecular_field": {"dielectric": "four"})"),
       {"molecular_field: dielectric \"four\" must be none, a number"}},
      {"ShortCutoff", with(R"("molecular_field": {"cutoff_angstrom": 2})"), {"molecular_field.cutoff_angstrom is 2"}},
      {"NoFieldLimit", with(R"("molecular_field": {"force_limit_n": 0})"), {"molecular_field.force_limit_n is 0"}},
      {"MoreUsersThanTools", with(R"("limits": {"manipulators": 2})"), {"limits.manipulators is 2"}},
      {"MoreUsersThanSlots", with(R"("limits": {"observers": 16})"), {"limits.observers is 16"}},
      {"NoSpeed", with(R"("limits": {"body_speed_m_per_s": 0})"), {"limits.body_speed_m_per_s is 0"}},
      {"NegativeReach", with(R"("limits": {"grab_reach_m": -1})"), {"limits.grab_reach_m is -1"}},
      {"TooManyBodies",
       physics::scene_json({.bodies = repeated(physics::kWall, proto::kMaxBodies + 1)}),
       {"bodies has 65 bodies; at most 64"}},
      {"TooManyTools",
       physics::scene_json({.tools = repeated(R"({"name": "t"})", proto::kMaxUsers + 1)}),
       {"tools has 17 tools"}},
  };
}

class BadSceneFile : public ::testing::TestWithParam<BadScene> {};

TEST_P(BadSceneFile, IsRefusedInWordsThatLeadToTheMistake) {
  const std::string message = refusal_of(GetParam().json);
  for (const std::string& part : GetParam().expected) EXPECT_THAT(message, HasSubstr(part));
}
std::string name_of_test(const ::testing::TestParamInfo<BadScene>& test) {
  return test.param.name;
}
INSTANTIATE_TEST_SUITE_P(Bodies, BadSceneFile, ::testing::ValuesIn(bad_bodies()), name_of_test);
INSTANTIATE_TEST_SUITE_P(ToolsAndSettings, BadSceneFile, ::testing::ValuesIn(bad_tools_and_settings()), name_of_test);

TEST(SceneFile, EveryDefaultIsFilledIn) {
  const auto scene = load_scene_text(physics::scene_json({.coupling = ""}), "s.json", ".");
  const wire::Scene& d = scene->description;
  EXPECT_EQ(d.step_rate_hz(), 1000U);
  EXPECT_EQ(d.gravity_m_per_s2(2), -9.81);
  EXPECT_EQ(d.bodies(0).friction(), 0.5);
  EXPECT_TRUE(d.bodies(0).gravity());
  EXPECT_EQ(d.bodies(0).placement().position_m_size(), 3);
  EXPECT_EQ(d.tools(0).mass_kg(), 0.05);
  EXPECT_EQ(d.tools(0).shapes(0).sphere().radius_m(), 0.005);
  EXPECT_EQ(d.coupling().law(), haptics::kDefaultCouplingLaw);
  EXPECT_EQ(scene->world.coupling.parameters, haptics::CouplingParameters{});
  EXPECT_FALSE(d.coupling().has_adaptive()) << "of another law";
  EXPECT_EQ(d.limits().manipulators(), 1U);
  EXPECT_EQ(d.limits().observers(), 4U);
  EXPECT_EQ(d.limits().grab_reach_m(), 0.02);
}

TEST(SceneFile, TheFitThatTheRefusalOfNoneShowsIsTheThesissAndTellsClients) {
  std::string refusal;
  try {
    load_scene_text(physics::scene_json({.coupling = R"({"law": "adaptive"})"}), "s.json", ".");
  } catch (const SceneError& error) {
    refusal = error.what();
  }
  const std::size_t shown = refusal.find('{');
  ASSERT_NE(shown, std::string::npos) << refusal;
  const std::string fit = refusal.substr(shown, refusal.rfind('}') + 1 - shown);
  const auto scene = load_scene_text(
      physics::scene_json({.coupling = R"({"law": "adaptive", "adaptive": )" + fit + "}"}), "s.json", ".");
  ASSERT_TRUE(scene->world.coupling.fit.has_value());
  const haptics::AdaptiveFit thesis = haptics::thesis_adaptive_fit();
  for (const double mass_kg : {0.01, 0.05, 0.1, 0.2, 0.5}) {
    EXPECT_EQ(haptics::adapted(*scene->world.coupling.fit, mass_kg, 1e-4, {}),
              haptics::adapted(thesis, mass_kg, 1e-4, {}))
        << mass_kg;
  }
  EXPECT_EQ(scene->description.coupling().adaptive().mass_range_kg(1), thesis.mass_high_kg);
}

TEST(SceneFile, AFitAcceptsAtMostTheLargestValuesOfAProfile) {
  const auto fit = [](double share) {
    const auto value = [share](double most) { return "[" + number_text(share * most) + "]"; };
    return R"({"law": "adaptive", "adaptive": {"mass_range_kg": [0.1, 1000], "stiffness_n_per_m": )" +
           value(haptics::kMaxFitStiffness_n_per_m) + R"(, "damping_n_s_per_m": )" +
           value(haptics::kMaxFitDamping_n_s_per_m) +
           R"(, "inertia_range_kg_m2": [1e-6, 1000], "stiffness_n_m_per_rad": )" +
           value(haptics::kMaxFitStiffness_n_m_per_rad) + R"(, "damping_n_m_s_per_rad": )" +
           value(haptics::kMaxFitDamping_n_m_s_per_rad) + "}}";
  };
  EXPECT_NO_THROW(physics::load_parts({.coupling = fit(1)}));
  EXPECT_THROW(physics::load_parts({.coupling = fit(1.01)}), SceneError);
}

TEST(SceneFile, AdaptiveFitIsReadAsWritten) {
  const auto scene = load_scene_text(physics::scene_json({.coupling = R"({"law": "adaptive", "adaptive": {
      "mass_range_kg": [0.1, 1], "stiffness_n_per_m": [100, 200], "damping_n_s_per_m": [1, 0.01],
      "inertia_range_kg_m2": [1e-5, 1e-3], "stiffness_n_m_per_rad": [0.1, 100], "damping_n_m_s_per_rad": [0.01]}})"}),
                                     "s.json", ".");
  const haptics::CouplingParameters base;
  const haptics::CouplingParameters c = physics::coupling_in_force(scene->world.coupling, {0.5, 1e-4, true});
  EXPECT_DOUBLE_EQ(c.stiffness_n_per_m, 200);
  EXPECT_DOUBLE_EQ(c.damping_n_s_per_m, 3);
  EXPECT_DOUBLE_EQ(c.stiffness_n_m_per_rad, 0.11);
  EXPECT_DOUBLE_EQ(c.damping_n_m_s_per_rad, 0.01);
  EXPECT_EQ(c.force_limit_n, base.force_limit_n);
  EXPECT_DOUBLE_EQ(physics::coupling_in_force(scene->world.coupling, {9, 1e-4, true}).stiffness_n_per_m, 300)
      << "nearest end";
}

TEST(SceneFile, EveryLawOfTheCatalogIsAccepted) {
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    const std::string name(law.name);
    const auto scene = physics::load_parts({.coupling = physics::coupling_with(name)});
    EXPECT_EQ(scene->description.coupling().law(), name);
  }
}

TEST(SceneFile, RestingHandleMeetsTheToolWhereItStarts) {
  const auto scene = load_scene_text(
      physics::scene_json(
          {.tools = R"({"name": "t", "placement": {"position_m": [1, 2, 3], "rotation_xyz_deg": [0, 0, 90]}})"}),
      "s.json", ".");
  const Pose X_WH = scene->workspaces[0].world_pose(Pose{});
  EXPECT_TRUE(X_WH.p.isApprox(Vec3(1, 2, 3)));
  EXPECT_LT(X_WH.q.angularDistance(scene->world.tools[0].X_WT.q), 1e-12);
}

TEST(SceneFile, RotationTurnsAboutFixedXThenYThenZ) {
  wire::Placement placement;
  for (const double degrees : {90.0, 0.0, 90.0}) placement.add_rotation_xyz_deg(degrees);
  // Rotations are about fixed axes, in the order x, y, z. The rotation about x leaves x unchanged and turns y to z. The
  // rotation about z turns x to y and leaves z unchanged.
  const Quat q = proto::pose_from_placement(placement).q;
  EXPECT_TRUE((q * Vec3::UnitX()).isApprox(Vec3::UnitY(), 1e-12));
  EXPECT_TRUE((q * Vec3::UnitY()).isApprox(Vec3::UnitZ(), 1e-12));
}

TEST(SceneFile, MissingFileIsRefused) {
  EXPECT_THROW(load_scene("/nowhere/scene.json"), SceneError);
  EXPECT_THROW(load_scene("/"), SceneError);
}

MassProperties mass_of(const std::string& shapes, double mass_kg) {
  const std::string body =
      R"({"name": "a", "mass_kg": )" + std::to_string(mass_kg) + R"(, "shapes": [)" + shapes + "]}";
  return load_scene_text(physics::scene_json({.bodies = body}), "s.json", ".")->world.bodies[0].mass;
}

TEST(MassProperties, OfPrimitivesAreTheTextbookOnes) {
  EXPECT_TRUE(mass_of(R"({"sphere": {"radius_m": 0.1}})", 2)
                  .principal_inertia_kg_m2.isApprox(Vec3::Constant(0.4 * 2 * 0.01), 1e-9));
  EXPECT_TRUE(mass_of(R"({"box": {"size_m": [0.1, 0.2, 0.3]}})", 12)
                  .principal_inertia_kg_m2.isApprox(Vec3(0.04 + 0.09, 0.01 + 0.09, 0.01 + 0.04), 1e-9));
  EXPECT_TRUE(mass_of(R"({"cylinder": {"radius_m": 0.1, "length_m": 0.6}})", 12)
                  .principal_inertia_kg_m2.isApprox(Vec3(0.03 + 0.36, 0.03 + 0.36, 0.06), 1e-9));
  // A capsule whose cylinder has almost no length must have the inertia of a sphere.
  EXPECT_TRUE(mass_of(R"({"capsule": {"radius_m": 0.1, "length_m": 1e-6}})", 2)
                  .principal_inertia_kg_m2.isApprox(Vec3::Constant(0.4 * 2 * 0.01), 1e-4));
}

TEST(MassProperties, OfTwoShapesFollowTheParallelAxisTheorem) {
  // Two equal spheres of 1 kg and radius 0.1 m, with centres at x = 0 and x = 1.
  const std::string ball = R"({"sphere": {"radius_m": 0.1}})";
  const MassProperties mass =
      mass_of(ball + R"(, {"sphere": {"radius_m": 0.1}, "placement": {"position_m": [1, 0, 0]}})", 2);
  EXPECT_TRUE(mass.X_BC.p.isApprox(Vec3(0.5, 0, 0), 1e-12));
  const double own = 0.4 * 2 * 0.01;
  EXPECT_TRUE(mass.principal_inertia_kg_m2.isApprox(Vec3(own, own + 0.5, own + 0.5), 1e-9));
}

class ShippedScene : public ::testing::TestWithParam<const char*> {};

TEST_P(ShippedScene, Loads) {
  TANDEM_LOAD_SCENE(scene, GetParam());
  EXPECT_EQ(scene->description.name(), GetParam());
  EXPECT_FALSE(scene->description.description().empty());
  EXPECT_EQ(scene->world.tools.size(), 2U);
}
INSTANTIATE_TEST_SUITE_P(SceneFile, ShippedScene,
                         ::testing::Values("peg_in_hole", "two_boxes", "bunny", "two_bunnies", "docking_helices",
                                           "soft_pad", "effects"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace tandem::server
