// Tests the stage of 3-DOF devices. Its force is compared with closed forms, for fixed, moving, held and triangulated
// bodies, and must keep its limits.
#include "client/haptics/stages/stage.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "client/model/proxy_world.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "common/geometry/surface_asset.hpp"
#include "common/geometry/tessellation.hpp"
#include "proto/scene_ranges.hpp"
#include "tests/client/haptics/haptic_rig.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {
namespace {

using testing::HasSubstr;

constexpr double kStiffness_n_per_m = 500, kDamping_n_s_per_m = 2;
constexpr double kRadius_m = 2e-3;

wire::Shape box_shape(const Vec3& size_m) {
  wire::Shape shape;
  for (const double edge : size_m) shape.mutable_box()->add_size_m(edge);
  return shape;
}
wire::Shape sphere_shape(double radius_m) {
  wire::Shape shape;
  shape.mutable_sphere()->set_radius_m(radius_m);
  return shape;
}

/// The server's reply to a user who joins with a ball of radius 2 mm. Each shape of the scene is a frictionless body at
/// the origin.
wire::Joined scene_of(const std::vector<wire::Shape>& shapes) {
  wire::Joined joined = test::minimal_joined();
  *joined.mutable_scene()->mutable_tools(0)->add_shapes() = sphere_shape(kRadius_m);
  for (const wire::Shape& shape : shapes) {
    wire::Body& body = *joined.mutable_scene()->add_bodies();
    *body.add_shapes() = shape;
    body.set_friction(0);
  }
  proto::complete_numbers(*joined.mutable_scene());
  return joined;
}

/// The stage in a scene. The test sets the pose of the hand and the received states.
struct Rig {
  explicit Rig(const wire::Joined& joined, const AssetMap& assets = {}, const Vec3& tool_W = {0, 0, 0.1})
      : world(joined, assets) {
    parameters.stiffness_n_per_m = kStiffness_n_per_m;
    parameters.damping_n_s_per_m = kDamping_n_s_per_m;
    parameters.force_limit_n = 1e3;
    law = haptics::make_coupling_law("spring-damper", parameters);
    received.update.tool.X.p = tool_W;
    input.newest = &received;
    input.coupling = law.get();
    input.parameters = &parameters;
    input.scene = &scene;
    input.proxy_world = &world;
    input.handle.X.p = tool_W;
  }
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  StageOutput tick() {
    input.now += std::chrono::milliseconds(1);
    return stage->tick(input);
  }
  /// Moves the hand to `to_W` in a straight line by at most 1 mm per tick.
  StageOutput move_to(const Vec3& to_W) {
    const Vec3 from_W = input.handle.X.p;
    const int ticks = 1 + static_cast<int>((to_W - from_W).norm() / 1e-3);
    StageOutput output;
    for (int i = 1; i <= ticks; ++i) {
      input.handle.X.p = from_W + (to_W - from_W) * i / ticks;
      output = tick();
    }
    return output;
  }
  Vec3 force_at(const Vec3& to_W) { return move_to(to_W).wrench_on_hand_W.f; }
  void set_body(const RigidState& body) {
    ++received.update.step.value;
    received.received = input.now;
    received.update.bodies.assign(1, {body_id_at(0), body, {}});
  }

  ProxyWorld world;
  haptics::CouplingParameters parameters;
  std::unique_ptr<haptics::CouplingLaw> law;
  ReceivedUpdate received;
  HapticScene scene;
  StageInput input;
  std::unique_ptr<Stage> stage = make_stage({.name = "god-object"});
};

TEST(GodObjectStage, PressesOutOfAPlaneByStiffnessTimesDepth) {
  Rig rig(scene_of({box_shape({0.2, 0.2, 0.02})}));
  EXPECT_EQ(rig.force_at({0, 0, 0.013}), Vec3::Zero()) << "a millimetre of air under the ball";
  const Vec3 force = rig.force_at({0.01, 0.02, 0.007});
  EXPECT_LT((force - Vec3(0, 0, kStiffness_n_per_m * (0.01 + kRadius_m - 0.007))).norm(), 1e-9);
  EXPECT_EQ(rig.world.radius_m(), kRadius_m) << "that of the tool's sphere";
}

TEST(GodObjectStage, PressesOutOfASphereAlongItsRadius) {
  Rig rig(scene_of({sphere_shape(0.03)}));
  const Vec3 direction = Vec3(1, 2, 2) / 3;
  rig.move_to(0.05 * direction);
  const Vec3 force = rig.force_at(0.025 * direction);
  EXPECT_LT((force - kStiffness_n_per_m * (0.03 + kRadius_m - 0.025) * direction).norm(), 1e-6);
}

TEST(GodObjectStage, PressesAcrossTheEdgeOfABox) {
  Rig rig(scene_of({box_shape({0.02, 0.2, 0.02})}));
  const Vec3 edge(0.01, 0, 0.01), out = Vec3(1, 0, 1).normalized();
  rig.move_to(edge + 5e-3 * out);
  const Vec3 force = rig.force_at(edge + 0.5e-3 * out);
  EXPECT_LT((force - kStiffness_n_per_m * (kRadius_m - 0.5e-3) * out).norm(), 1e-6);
}

TEST(GodObjectStage, FrictionIsTheRootOfBothCoefficients) {
  wire::Joined joined = scene_of({box_shape({0.2, 0.2, 0.02})});
  joined.mutable_scene()->mutable_bodies(0)->set_friction(0.9);
  joined.mutable_scene()->mutable_tools(0)->set_friction(0.4);
  Rig rig(joined);
  rig.move_to({0, 0, 0.007});
  const Vec3 sliding = rig.force_at({0.05, 0, 0.007});
  EXPECT_NEAR(-sliding.x() / sliding.z(), 0.6, 1e-6) << "√(0.9 · 0.4)";
}

/// A box as a triangle mesh. The server sends such a mesh as a surface asset.
struct MeshScene {
  explicit MeshScene(const geometry::TriangleMesh& mesh = geometry::tessellated_box(Vec3(0.03, 0.03, 0.02))) {
    const auto bytes = std::make_shared<const proto::Bytes>(geometry::surface_asset_bytes(mesh));
    const proto::Sha256 hash = proto::sha256_of(*bytes);
    assets[hash] = bytes;
    wire::Shape shape;
    shape.mutable_mesh()->set_file("box.obj");
    shape.mutable_mesh()->set_surface_sha256(hash.data(), hash.size());
    joined = scene_of({shape});
  }
  wire::Joined joined;
  AssetMap assets;
};

TEST(GodObjectStage, NeverEntersAMeshThatItIsDrawnThrough) {
  const MeshScene scene;
  Rig rig(scene.joined, scene.assets);
  const auto box = contact::box_field(Vec3(0.03, 0.03, 0.02));
  rig.move_to({0.001, 0.002, 0.02});
  for (const Vec3& to_W : {Vec3(0.001, 0.002, -0.002), Vec3(0.02, 0.01, -0.003), Vec3(-0.02, -0.02, 0.0)}) {
    const Vec3 from_W = rig.input.handle.X.p;
    for (int i = 1; i <= 200; ++i) {
      rig.input.handle.X.p = from_W + (to_W - from_W) * i / 200;
      const Vec3 ball_W = rig.tick().tool.X.p;
      // The vertices of the asset have single precision, which is 1 nm at 15 mm. The bound allows 2 nm.
      ASSERT_GE(box->distance_m(ball_W), kRadius_m - haptics::GodObject::kTolerance_m - 2e-9) << ball_W.transpose();
    }
  }
}

TEST(GodObjectStage, AMeshPressesAsTheBoxThatItIs) {
  const MeshScene scene;
  Rig rig(scene.joined, scene.assets);
  rig.move_to({0.001, 0.002, 0.02});
  const Vec3 force = rig.force_at({0.001, 0.002, 0.007});
  EXPECT_LT((force - Vec3(0, 0, kStiffness_n_per_m * (0.01 + kRadius_m - 0.007))).norm(), 1e-5);
}

TEST(GodObjectStage, AnApproachingBodyPushesTheHandAndThenResists) {
  Rig rig(scene_of({box_shape({0.02, 0.2, 0.2})}), {}, {0.03, 0, 0});
  const double speed_m_per_s = 0.1;
  Vec3 before = Vec3::Zero(), force = Vec3::Zero();
  for (int i = 0; i <= 250; ++i) {
    // A state arrives only every 10 ms. Between two states the stage extrapolates the body by its velocity.
    if (i % 10 == 0)
      rig.set_body({{Vec3(1e-4 * i, 0, 0), Quat::Identity()}, {Vec3(speed_m_per_s, 0, 0), Vec3::Zero()}});
    force = rig.tick().wrench_on_hand_W.f;
    EXPECT_GE(force.x(), before.x());
    EXPECT_LT((force - before).norm(), 0.3) << "tick " << i;
    before = force;
  }
  const double depth_m = 0.025 + 1e-4 + 0.01 + kRadius_m - 0.03;
  EXPECT_NEAR(force.x(), kStiffness_n_per_m * depth_m + kDamping_n_s_per_m * speed_m_per_s, 1e-9);
  rig.set_body({{Vec3(0.025, 0, 0), Quat::Identity()}, {}});
  EXPECT_NEAR(rig.tick().wrench_on_hand_W.f.x(), kStiffness_n_per_m * (depth_m - 1e-4), 1e-9);
}

TEST(GodObjectStage, ABodyIsCarriedOnForTwentyMillisecondsAndNoLonger) {
  Rig rig(scene_of({box_shape({0.02, 0.2, 0.2})}), {}, {0.011, 0, 0});
  rig.set_body({{}, {Vec3(0.1, 0, 0), Vec3::Zero()}});
  Vec3 force = Vec3::Zero();
  for (int i = 0; i < 1000; ++i) force = rig.tick().wrench_on_hand_W.f;
  EXPECT_NEAR(force.x(), kStiffness_n_per_m * (0.002 + 0.01 + kRadius_m - 0.011) + kDamping_n_s_per_m * 0.1, 1e-9);
}

TEST(GodObjectStage, AHeldBodyIsNotFeltUntilTheBallIsClearOfIt) {
  for (const bool is_mesh : {false, true}) {
    const MeshScene mesh;
    Rig rig(is_mesh ? mesh.joined : scene_of({box_shape({0.03, 0.03, 0.02})}), mesh.assets);
    EXPECT_GT(rig.force_at({0, 0, 0.011}).z(), 0.1);
    rig.received.update.held_body = body_id_at(0);
    rig.set_body({});
    rig.tick();
    EXPECT_EQ(rig.tick().wrench_on_hand_W.f, Vec3::Zero()) << "held";
    EXPECT_EQ(rig.force_at({0, 0, 0.005}), Vec3::Zero()) << "and moved";
    rig.received.update.held_body = {};
    rig.set_body({});
    EXPECT_EQ(rig.force_at({0, 0, 0.0055}), Vec3::Zero()) << "let go: the ball is still inside";
    EXPECT_EQ(rig.force_at({0, 0, 0.02}), Vec3::Zero());
    EXPECT_GT(rig.force_at({0, 0, 0.011}).z(), 0.1) << "it was clear of it";
  }
}

TEST(GodObjectStage, AMovingBodyIsNotFeltWhereItWasBeforeItsFirstState) {
  wire::Joined joined = scene_of({box_shape({0.02, 0.02, 0.02})});
  joined.mutable_scene()->mutable_bodies(0)->set_mass_kg(0.1);
  Rig rig(joined);
  EXPECT_EQ(rig.force_at({0, 0, 0.005}), Vec3::Zero()) << "it may be elsewhere by now";
  rig.set_body({{Vec3(0, 0, 0.04), Quat::Identity()}, {}});
  EXPECT_EQ(rig.force_at({0, 0, 0.006}), Vec3::Zero()) << "a jump of the body must not push the proxy along";
  EXPECT_NEAR(rig.force_at({0, 0, 0.031}).z(), -kStiffness_n_per_m * (0.031 + kRadius_m - 0.03), 1e-9);
}

TEST(GodObjectStage, BeginsAnewAfterASilenceInWhichBodiesMayHavePassed) {
  Rig rig(scene_of({box_shape({0.02, 0.2, 0.2})}), {}, {0.05, 0, 0});
  rig.set_body({});
  rig.tick();
  for (int i = 0; i < 200; ++i) rig.tick();
  rig.set_body({{Vec3(0.1, 0, 0), Quat::Identity()}, {}});
  EXPECT_EQ(rig.tick().wrench_on_hand_W.f, Vec3::Zero()) << "the box jumped to the other side of the proxy";
  rig.set_body({{Vec3(0, 0, 0), Quat::Identity()}, {}});
  EXPECT_LT(rig.tick().wrench_on_hand_W.f.x(), -1) << "within milliseconds it would have swept the hand along";
}

TEST(GodObjectStage, BeginsAtTheServersToolHoweverFarTheHandIsInside) {
  Rig rig(scene_of({box_shape({0.2, 0.2, 0.2})}), {}, {0.11, 0, 0});
  rig.input.handle.X.p = Vec3(-0.02, 0, 0.01);
  const StageOutput output = rig.tick();
  EXPECT_NEAR(output.tool.X.p.x(), 0.1 + kRadius_m, 1e-6) << "on the tool's side, although the opposite face is nearer";
}

TEST(GodObjectStage, StartsWithoutAForceStepIfTheHandIsAlreadyInside) {
  Rig rig(scene_of({box_shape({0.2, 0.2, 0.2})}), {}, {0.11, 0, 0});
  rig.input.handle.X.p = Vec3(0.09, 0, 0);
  Vec3 before = Vec3::Zero();
  for (int i = 0; i < 200; ++i) {
    const Vec3 force = rig.tick().wrench_on_hand_W.f;
    ASSERT_LE((force - before).norm(), 0.05 * kStiffness_n_per_m * 0.012) << i;
    before = force;
  }
  EXPECT_NEAR(before.x(), kStiffness_n_per_m * (0.01 + kRadius_m), 1e-3) << "all of it after 200 ms";
}

TEST(GodObjectStage, HasNoTorqueOnAHandThatTurns) {
  Rig rig(scene_of({box_shape({0.2, 0.2, 0.02})}));
  rig.input.handle.X.q = quaternion_of(Vec3(0.3, -1, 0.2));
  rig.input.handle.V.w = Vec3(3, 2, 1);
  const StageOutput output = rig.move_to({0, 0, 0.005});
  EXPECT_GT(output.wrench_on_hand_W.f.norm(), 1);
  EXPECT_EQ(output.wrench_on_hand_W.t, Vec3::Zero());
  EXPECT_EQ(output.mode, proto::ClientMode::kHandle) << "the server's tool follows the handle";
}

TEST(GodObjectStage, StaysFiniteForAnyReceivedBodies) {
  Rig rig(scene_of({box_shape({0.2, 0.2, 0.02}), sphere_shape(0.01)}));
  rig.move_to({0, 0, 0.005});
  const double huge = 1e308, nothing = std::numeric_limits<double>::quiet_NaN();
  for (const double number : {huge, -huge, nothing}) {
    rig.set_body(
        {{Vec3::Constant(number), Quat(number, 0, number, 0)}, {Vec3::Constant(number), Vec3::Constant(number)}});
    rig.received.update.bodies.push_back({BodyId{0}, {}, {}});
    rig.received.update.bodies.push_back({BodyId{77}, {}, {}});
    EXPECT_TRUE(is_finite(rig.tick().wrench_on_hand_W)) << number;
  }
}

/// The whole haptic path of a 6-DOF device that presses against a plate.
struct PressingRig : HapticRig {
  PressingRig() : HapticRig("god-object") {
    scene.coupling.stiffness_n_per_m = 1000;
    scene.coupling.force_limit_n = 50;
    received.update.tool.X.p.z() = device.sample.X_DH.p.z() = 0.05;
    enter_scene();
    auto rendering = std::make_unique<Rendering>();
    rendering->stage = make_stage({.name = "god-object"});
    rendering->generation = scene.generation;
    rendering->proxy_world = std::make_unique<ProxyWorld>(scene_of({box_shape({0.2, 0.2, 0.02})}), AssetMap{});
    EXPECT_TRUE(core.offer(rendering));
    run(1500);
  }
  /// Moves the device down at 0.1 m/s and stops it at `z_m`.
  void press_to(double z_m) {
    double& z = device.sample.X_DH.p.z();
    while (z > z_m) {
      z = std::max(z_m, z - 1e-4);
      run(1);
    }
    run(200);
  }
};

TEST(GodObjectStageInTheHapticPath, IsClampedByTheDeviceWithoutTorqueAndGoesWhenTheServerDoes) {
  PressingRig rig;
  EXPECT_EQ(rig.force(), Vec3::Zero());
  rig.press_to(0.009);
  EXPECT_NEAR(rig.force().z(), 1000 * (0.01 + kRadius_m - 0.009), 1e-6);
  EXPECT_EQ(rig.core.record().displayed_on_hand_D.t, Vec3::Zero());
  rig.press_to(-0.01);
  EXPECT_NEAR(rig.force().norm(), 8, 1e-6) << "the device's force limit; the law computes 22 N";
  for (int i = 0; i < 151; ++i) rig.tick();
  EXPECT_EQ(rig.force(), Vec3::Zero()) << "150 ms without a state";
  EXPECT_TRUE(rig.device.all_finite);
}

std::string failure_of(const wire::Joined& joined, const AssetMap& assets = {}) {
  try {
    const ProxyWorld world(joined, assets);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ProxyWorld, NamesTheFieldThatItCannotUse) {
  const MeshScene good;
  EXPECT_EQ(failure_of(good.joined, good.assets), "accepted");
  EXPECT_THAT(failure_of(good.joined), HasSubstr("the surface of box.obj is not here"));
  AssetMap torn = good.assets;
  torn.begin()->second = std::make_shared<const proto::Bytes>(100);
  EXPECT_THAT(failure_of(good.joined, torn), HasSubstr("the surface of box.obj cannot be read"));
  EXPECT_THAT(failure_of(scene_of({sphere_shape(std::numeric_limits<double>::infinity())})),
              HasSubstr("scene.bodies[0].shapes[0].sphere.radius_m is inf"));
  wire::Joined slippery = scene_of({sphere_shape(0.01)});
  slippery.mutable_scene()->mutable_bodies(0)->set_friction(-1);
  EXPECT_THAT(failure_of(slippery), HasSubstr("scene.bodies[0].friction is -1"));
  wire::Joined far = scene_of({sphere_shape(0.01)});
  for (int i = 0; i < 3; ++i) far.mutable_scene()->mutable_bodies(0)->mutable_placement()->add_position_m(1e9);
  EXPECT_THAT(failure_of(far), HasSubstr("scene.bodies[0].placement"));
  for (const bool is_molecule : {false, true}) {
    wire::Joined bare = scene_of({sphere_shape(0.01)});
    wire::Shape& shape = *bare.mutable_scene()->mutable_tools(0)->add_shapes();
    if (is_molecule) shape.mutable_molecule();
    EXPECT_EQ(failure_of(bare), "accepted") << "a tool's shape without extent makes no ball";
  }
  geometry::TriangleMesh fan;
  fan.vertices.emplace_back(Vec3::Zero());
  for (int i = 0; i <= 5000; ++i) fan.vertices.emplace_back(std::cos(1e-3 * i), std::sin(1e-3 * i), 0);
  for (int i = 1; i <= 5000; ++i) fan.triangles.push_back({0, i, i + 1});
  const MeshScene fanned(fan);
  EXPECT_THAT(failure_of(fanned.joined, fanned.assets), HasSubstr("has 5000 triangles at one vertex"));
  wire::Joined huge = good.joined;
  huge.mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_mesh()->clear_surface_sha256();
  EXPECT_THAT(failure_of(huge), HasSubstr("box.obj is too large for the server to offer it"));
  wire::Joined flat = scene_of({sphere_shape(0.01)});
  flat.mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_box()->add_size_m(1);
  EXPECT_THAT(failure_of(flat), HasSubstr("scene.bodies[0].shapes[0].box.size_m has 1 numbers"));
}

TEST(ProxyWorld, UsesTheLargestBallOfTheToolOrReportsThatThereIsNone) {
  wire::Joined pen = scene_of({sphere_shape(0.01)});
  wire::Tool& tool = *pen.mutable_scene()->mutable_tools(0);
  *tool.mutable_shapes(0) = box_shape({0.02, 0.006, 0.1});
  EXPECT_NEAR(ProxyWorld(pen, {}).radius_m(), 0.003, 1e-12);
  EXPECT_THAT(ProxyWorld(pen, {}).note(), HasSubstr("a ball of 3 mm radius (the largest in its tool)"));
  for (const double x : {1.0, 0.0, 0.0}) tool.mutable_shapes(0)->mutable_placement()->add_position_m(x);
  EXPECT_EQ(ProxyWorld(pen, {}).radius_m(), ProxyWorld::kDefaultRadius_m);
  EXPECT_THAT(ProxyWorld(pen, {}).note(), HasSubstr("a ball of 5 mm radius (its tool has none about its origin)"));
}

TEST(ProxyWorld, ReportsThePartsOfTheSceneThatAreNotFelt) {
  wire::Joined joined = scene_of({sphere_shape(0.01), sphere_shape(0.01)});
  EXPECT_THAT(ProxyWorld(joined, {}).note(),
              testing::AllOf(HasSubstr("touches 2 shapes"), testing::Not(HasSubstr("molecules"))));
  joined.mutable_scene()->mutable_bodies(1)->mutable_shapes(0)->mutable_molecule();
  joined.mutable_scene()->add_soft_bodies();
  proto::complete_numbers(*joined.mutable_scene());
  EXPECT_THAT(ProxyWorld(joined, {}).note(),
              testing::AllOf(HasSubstr("touches 1 shape with"), HasSubstr("nor the molecules"),
                             HasSubstr("nor the soft bodies")));
}

TEST(ProxyProblem, NamesTheRemedyIfABallCanTouchNothing) {
  EXPECT_EQ(proxy_problem(scene_of({sphere_shape(0.01)})), "");
  wire::Shape molecule;
  molecule.mutable_molecule()->set_file("1abc.pdb");
  EXPECT_THAT(proxy_problem(scene_of({molecule, molecule})), HasSubstr("use stage local-model"));
  EXPECT_EQ(proxy_problem(scene_of({molecule, sphere_shape(0.01)})), "");
  EXPECT_THAT(proxy_problem(scene_of(std::vector(65, sphere_shape(0.01)))), HasSubstr("65 shapes"));
  EXPECT_EQ(proxy_problem(scene_of(std::vector(64, sphere_shape(0.01)))), "");
  wire::Joined direct = scene_of({sphere_shape(0.01)});
  direct.mutable_scene()->mutable_coupling()->set_law("direct");
  EXPECT_THAT(proxy_problem(direct), HasSubstr("use stage hold"));
  direct.set_role(wire::ROLE_OBSERVER);
  EXPECT_EQ(proxy_problem(direct), "") << "an observer needs no proxy";
}

}  // namespace
}  // namespace tandem::client
