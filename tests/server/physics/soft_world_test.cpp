// Tests soft bodies. The stiffness of the solver does not follow directly from its coefficients. Therefore the wrench
// on a tool is compared with the change of momentum of the nodes, and its derivative with finite differences of a soft
// step.
#include "server/physics/soft_world.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "common/contact/contact_reduction.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "server/assets/soft_scene.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/server/physics/soft_support.hpp"

namespace tandem::server {
namespace {

double lowest_m(const SoftWorld& world) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& node : world.nodes_W(0)) lowest = std::min(lowest, node.z());
  return lowest;
}

TEST(SoftModel, BlockHasTheStatedMassVolumeAndClosedSurface) {
  SoftTraits traits;
  traits.mass_kg = 0.7;
  const SoftModel model = make_soft_block(Vec3(0.08, 0.06, 0.04), 0.02, traits);
  EXPECT_EQ(model.nodes_W.size(), 5U * 4U * 3U);
  double mass = 0;
  for (const double share : model.mass_kg) mass += share;
  EXPECT_NEAR(mass, 0.7, 1e-12);
  EXPECT_NEAR(enclosed_volume_m3(model.nodes_W, model.faces), 0.08 * 0.06 * 0.04, 1e-12);
  std::map<std::pair<int, int>, int> uses;
  for (const auto& face : model.faces) {
    for (std::size_t i = 0; i < 3; ++i) ++uses[{face[i], face[(i + 1) % 3]}];
  }
  for (const auto& [edge, count] : uses) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(uses.count({edge.second, edge.first}), 1U) << "an edge without its other triangle";
  }
}

TEST(SoftModel, NoPlaceOfTheSurfaceIsFarFromASample) {
  const SoftModel model = make_soft_block(Vec3(0.03, 0.03, 0.03), 0.01, {});
  for (const auto& face : model.faces) {
    const auto node = [&](std::size_t i) { return model.nodes_W[static_cast<std::size_t>(face[i])]; };
    const Vec3 place = 0.37 * node(0) + 0.41 * node(1) + 0.22 * node(2);
    double nearest = std::numeric_limits<double>::infinity();
    for (const SoftSample& sample : model.samples) {
      Vec3 p = Vec3::Zero();
      for (std::size_t i = 0; i < 3; ++i)
        p += sample.weights[i] * model.nodes_W[static_cast<std::size_t>(sample.nodes[i])];
      nearest = std::min(nearest, (p - place).norm());
    }
    EXPECT_LT(nearest, kSoftSampleSpacing_m / std::sqrt(2.0));
  }
}

TEST(SoftWorld, PeriodIsAWholeNumberOfRoomSteps) {
  EXPECT_EQ(soft_period_steps(1000, 60), 17);
  EXPECT_EQ(soft_period_steps(1000, 1000), 1);
  EXPECT_EQ(soft_period_steps(60, 60), 1);
}

TEST(SoftWorld, PadDroppedOnATableRestsOnIt) {
  SoftWorldSettings settings = pad_settings(0);
  for (Vec3& node : settings.bodies[0].nodes_W) node.z() += 0.02;
  SoftWorld world(std::move(settings));
  const SoftModel& model = world.model(0);
  const double step_s = world.period_steps() / 1000.0;
  std::vector<Vec3> before(world.nodes_W(0).begin(), world.nodes_W(0).end());
  double energy_start = 0;
  for (std::size_t i = 0; i < before.size(); ++i) energy_start += model.mass_kg[i] * 9.81 * before[i].z();
  for (int step = 0; step < 150; ++step) {
    soft_step(world, kAway);
    double energy = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const Vec3 velocity = (world.nodes_W(0)[i] - before[i]) / step_s;
      energy += model.mass_kg[i] * (0.5 * velocity.squaredNorm() + 9.81 * world.nodes_W(0)[i].z());
    }
    // Implicit Euler integration loses energy by its own error: in the first step h, the body falls by g h² / 2 too far
    // without being faster. Therefore only an increase of the energy is a fault.
    EXPECT_LE(energy, energy_start * (1 + 1e-9)) << "soft step " << step;
    before.assign(world.nodes_W(0).begin(), world.nodes_W(0).end());
  }
  EXPECT_NEAR(lowest_m(world), 0, 1e-3);
  soft_step(world, kAway);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT((world.nodes_W(0)[i] - before[i]).norm() / step_s, 1e-3) << "node " << i << " does not rest";
  }
}

TEST(SoftWorld, TheForceRisesWithDepthAndEndsAfterLeaving) {
  SoftWorld world(pad_settings(0));
  soft_steps(world, kAway, 20);
  double before_n = 0;
  for (const double depth_m : {0.004, 0.006, 0.008, 0.010, 0.012}) {
    soft_steps(world, ball_in_pad(depth_m), 20);
    const double force_n = world.contact(0).wrench_W.f.z();
    EXPECT_GT(force_n, before_n) << depth_m;
    before_n = force_n;
  }
  EXPECT_GT(before_n, 0.3);
  soft_steps(world, kAway, 4);
  EXPECT_EQ(world.contact(0).wrench_W.f.norm(), 0);
  EXPECT_EQ(world.contact(0).trust_radius_m, 0);
  EXPECT_EQ(physics::soft_wrench(world.contact(0), kAway).f.norm(), 0);
}

/// Returns the sum over all nodes of mass times displacement [kg·m], which is the total momentum times the duration of
/// the step. Forces between nodes cancel in this sum.
Vec3 way_of_mass(const SoftModel& model, std::span<const Vec3> before, std::span<const Vec3> now) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < now.size(); ++i) sum += model.mass_kg[i] * (now[i] - before[i]);
  return sum;
}

TEST(SoftWorld, TheForcesOnToolAndNodesAreOpposite) {
  SoftWorld world(floating_settings());
  const double step_s = world.period_steps() / 1000.0;
  // Holds the ball just above the pad for 25 soft steps. After this time, the contact is a predicted one.
  soft_steps(world, ball_at(Vec3(0, 0, 0.0555)), 25);
  int light_touches = 0;
  Vec3 p_WT(0, 0, 0.0555);
  std::vector<Vec3> before(world.nodes_W(0).begin(), world.nodes_W(0).end());
  Vec3 way_before = Vec3::Zero();
  double largest_n = 0;
  for (int step = 0; step < 40; ++step) {
    // The tool moves down into the pad, and sideways so that friction acts as well.
    const Pose tool = ball_at(Vec3(0.0005 * step, 0, 0.056 - 0.0004 * step));
    soft_step(world, tool);
    const Vec3 way = way_of_mass(world.model(0), before, world.nodes_W(0));
    const Vec3 force_on_nodes_W = (way - way_before) / (step_s * step_s);
    way_before = way;
    before.assign(world.nodes_W(0).begin(), world.nodes_W(0).end());
    const Vec3 p_WT_before = std::exchange(p_WT, tool.p);
    if (force_on_nodes_W.norm() < 1e-9) continue;  // no contact yet, or only a predicted contact
    EXPECT_LT((force_on_nodes_W + world.contact(0).wrench_W.f).norm(), 1e-9) << "soft step " << step;
    EXPECT_EQ(world.contact(0).X_WT0.p, p_WT_before) << "where that step had it";
    light_touches += force_on_nodes_W.norm() < 0.1 ? 1 : 0;
    largest_n = std::max(largest_n, force_on_nodes_W.norm());
  }
  EXPECT_GT(largest_n, 0.05) << "no force was large enough for the test";
  EXPECT_GT(light_touches, 2);
}

/// Returns the contact for a tool that has rested at `depth_m` and then, for one soft step, was at `last`.
SoftContact contact_after(const SoftWorldSettings& settings, double depth_m, const Pose& last) {
  SoftWorld world(settings);
  soft_steps(world, kAway, 10);
  for (int i = 1; i <= 10; ++i) soft_step(world, ball_in_pad(depth_m * i / 10));
  soft_steps(world, ball_in_pad(depth_m), 5);
  soft_step(world, last);
  room_step(world, last);
  return world.contact(0);
}

class SoftGradient : public ::testing::TestWithParam<std::tuple<SoftSides, double>> {};

TEST_P(SoftGradient, IsThatOfTheSoftStep) {
  const auto [anchored, depth_m] = GetParam();
  const SoftWorldSettings settings = pad_settings(anchored);
  const Pose there = ball_in_pad(depth_m);
  const Mat6 stiffness = contact_after(settings, depth_m, there).stiffness;
  constexpr double kStep_m = 1e-5;
  for (int axis = 0; axis < 6; ++axis) {
    const double step = axis < 3 ? kStep_m : kStep_m / kBallRadius_m;
    Vec6 wrench[2];
    for (const int side : {0, 1}) {
      Pose moved = there;
      const Vec3 way = (side == 0 ? -step : step) * Vec3::Unit(axis % 3);
      if (axis < 3) moved.p += way;
      if (axis >= 3) moved.q = quaternion_of(way);
      wrench[side] = as_vector(contact_after(settings, depth_m, moved).wrench_W);
    }
    const double difference = -(wrench[1] - wrench[0])[axis] / (2 * step);
    EXPECT_GT(difference, 0) << "axis " << axis;
    EXPECT_NEAR(stiffness(axis, axis), difference, 0.25 * difference) << "axis " << axis;
  }
  EXPECT_EQ(stiffness, Mat6(stiffness.transpose()));
  const Vec6 eigenvalues = stiffness.selfadjointView<Eigen::Lower>().eigenvalues();
  EXPECT_GT(eigenvalues.minCoeff(), -1e-9 * eigenvalues.maxCoeff());
}
INSTANTIATE_TEST_SUITE_P(SoftWorld, SoftGradient,
                         ::testing::Values(std::tuple{SoftSides{0}, 0.006}, std::tuple{SoftSides{16}, 0.006},
                                           std::tuple{SoftSides{16}, 0.012}),
                         [](const auto& test) {
                           return std::string(std::get<0>(test.param) == 0 ? "Free" : "Glued") +
                                  std::to_string(std::lround(std::get<1>(test.param) * 1e3)) + "mm";
                         });

TEST(SoftWorld, ResultIsUsedOneSoftPeriodAfterItsInput) {
  SoftWorld world(pad_settings(16));
  const Pose tool = ball_in_pad(0.006);
  for (int step = 0; step <= world.period_steps(); ++step) {
    room_step(world, tool);
    EXPECT_EQ(world.contact(0).trust_radius_m > 0, step == world.period_steps()) << "room step " << step;
  }
}

TEST(SoftWorld, StartsAnewWhenItIsNotFinite) {
  SoftWorldSettings settings = pad_settings(0);
  settings.gravity_m_per_s2 = Vec3(0, 0, std::numeric_limits<double>::quiet_NaN());
  SoftWorld world(std::move(settings));
  soft_step(world, kAway);
  EXPECT_NE(soft_step(world, kAway) & kFaultNotFinite, 0U);
  for (const Vec3& node : world.nodes_W(0)) EXPECT_TRUE(is_finite(node));
}

TEST(SoftWorld, AToolThatIsNotFiniteIsIgnored) {
  SoftWorld world(pad_settings(0));
  Pose broken = ball_in_pad(0.006);
  broken.p.x() = std::numeric_limits<double>::quiet_NaN();
  soft_steps(world, broken, 5);
  EXPECT_EQ(soft_step(world, broken) & kFaultNotFinite, 0U);
  EXPECT_EQ(world.contact(0).trust_radius_m, 0);
}

/// Returns the force on a ball that has been held at `depth_m` in the pad for 1 s [N].
double resting_force_n(double depth_m) {
  SoftWorld world(pad_settings(16));
  soft_steps(world, ball_in_pad(depth_m), 60);
  return physics::soft_wrench(world.contact(0), ball_in_pad(depth_m)).f.z();
}

TEST(SoftWorld, PredictsATouch) {
  SoftWorld world(pad_settings(16));
  soft_steps(world, kAway, 5);
  EXPECT_EQ(world.contact(0).trust_radius_m, 0) << "too far for a prediction";
  soft_steps(world, ball_in_pad(-0.02), 25);
  const SoftContact contact = world.contact(0);
  const auto force_n = [&](double depth_m) { return physics::soft_wrench(contact, ball_in_pad(depth_m)).f.z(); };
  EXPECT_EQ(force_n(-0.02), 0) << "where the ball is";
  EXPECT_EQ(force_n(-0.001), 0);
  EXPECT_NEAR(force_n(0.003), resting_force_n(0.003), 0.3 * resting_force_n(0.003));
  EXPECT_NEAR(force_n(0.006), resting_force_n(0.006), 0.4 * resting_force_n(0.006));
}

TEST(SoftWorld, PredictedTouchIsFeltWhenItComesAndGoesOverIntoTheTouchWithoutAStep) {
  SoftWorld world(pad_settings(16));
  soft_steps(world, ball_in_pad(-0.01), 25);
  double before_n = 0, greatest_step_n = 0, touched_at_m = 1;
  for (int ms = 0; ms <= 800; ++ms) {
    const double depth_m = -0.01 + 2.5e-5 * ms;  // 25 mm/s; 10 mm deep at the end
    const Pose tool = ball_in_pad(depth_m);
    room_step(world, tool);
    const double force_n = physics::soft_wrench(world.contact(0), tool).f.z();
    greatest_step_n = std::max(greatest_step_n, std::abs(force_n - before_n));
    if (force_n > 0 && touched_at_m == 1) touched_at_m = depth_m;
    before_n = force_n;
  }
  EXPECT_GT(before_n, 0.3);
  // Contact must begin smoothly. The tool moves by 0.4 mm in a soft step. Without prediction of contacts, the user
  // would feel the whole force of the first soft step in contact at once.
  EXPECT_NEAR(touched_at_m, 0, 3e-4);
  EXPECT_LT(greatest_step_n, 0.12 * before_n) << "from one soft step's contact to the next";
}

TEST(SoftWorld, OfTwoSoftBodiesTheNearerIsPredicted) {
  SoftWorldSettings settings = pad_settings(16);
  SoftTraits traits;
  traits.mass_kg = 0.25;
  traits.anchored = 16;
  traits.X_WS.p = Vec3(0, 0.1, kPadHeight_m / 2 - 0.015);
  settings.bodies.push_back(make_soft_block(Vec3(0.08, 0.08, kPadHeight_m), 0.0134, traits));
  SoftWorld world(std::move(settings));
  const Pose tool = ball_at(Vec3(0.003, 0.03, kPadHeight_m + kBallRadius_m + 0.01));
  soft_steps(world, tool, 60);
  const auto force_n = [&](double down_m) {
    return physics::soft_wrench(world.contact(0), ball_at(tool.p - Vec3(0, 0, down_m))).f.norm();
  };
  EXPECT_EQ(force_n(0), 0) << "1 cm above";
  EXPECT_EQ(force_n(0.009), 0);
  EXPECT_GT(force_n(0.013), 0.1) << "in contact with the nearer pad, far above the other";
}

TEST(SoftWorld, ToolThatLeavesHasNoContactAtOnce) {
  SoftWorld world(pad_settings(16));
  soft_steps(world, ball_in_pad(0.008), 10);
  ASSERT_GT(world.contact(0).wrench_W.f.z(), 0);
  room_step(world, std::nullopt);
  EXPECT_EQ(world.contact(0).wrench_W.f.norm(), 0);
}

TEST(SoftWorld, BallDoesNotJumpThroughAPadInOneSoftStep) {
  // The ball moves from above the pad to below its centre in one soft step of 17 ms. The nodes on its path must be
  // carried along and push back.
  SoftWorld world(pad_settings(16));
  soft_steps(world, ball_at(Vec3(0, 0, 0.07)), 3);
  soft_steps(world, ball_at(Vec3(0, 0, 0.03)), 2);
  EXPECT_GT(world.contact(0).wrench_W.f.z(), 0.5);
  for (const auto& face : world.model(0).faces) {
    const Vec3& node = world.nodes_W(0)[static_cast<std::size_t>(face[0])];
    EXPECT_GT((node - Vec3(0, 0, 0.03)).norm(), kBallRadius_m - 1e-3);
  }
}

SoftContact pushing_up() {
  SoftContact contact;
  contact.wrench_W = {Vec3(0.1, 0, 1), Vec3(0.01, 0, 0)};
  Mat6 root = Mat6::Zero();
  root << 4, 1, 2, 0, 0.1, 0, 0, 6, 1, 0.1, 0, 0, 1, 0, 15, 0, 0, 0.1, 0, 0, 0, 0.2, 0, 0, 0, 0, 0, 0, 0.2, 0, 0, 0, 0,
      0, 0, 0.1;
  contact.stiffness = root.transpose() * root;
  contact.X_WT0.p = Vec3(1, 2, 3);
  contact.trust_radius_m = 0.005;
  contact.lever_m = 0.01;
  return contact;
}

TEST(SoftWrench, IsLinearWhereItIsTrusted) {
  const SoftContact contact = pushing_up();
  Pose X_WT = contact.X_WT0;
  EXPECT_EQ(as_vector(physics::soft_wrench(contact, X_WT)), as_vector(contact.wrench_W));
  Vec6 way;
  way << 1e-4, 2e-4, -1e-4, 0.01, -0.02, 0.01;
  X_WT.p += way.head<3>();
  X_WT.q = quaternion_of(way.tail<3>());
  const Vec6 expected = as_vector(contact.wrench_W) - contact.stiffness * way;
  EXPECT_LT((as_vector(physics::soft_wrench(contact, X_WT)) - expected).norm(), 1e-9);
}

TEST(SoftWrench, NeverPullsIsNotCarriedToTheSidesAndEndsContinuously) {
  const SoftContact contact = pushing_up();
  const double most_n =
      contact.wrench_W.f.norm() + contact.stiffness.topRows<3>().norm() * contact.trust_radius_m * std::hypot(1, 100);
  for (const Vec3& direction : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(0.8, 0, 0.6)}) {
    Wrench before = contact.wrench_W;
    for (int i = 1; i <= 3000; ++i) {
      const double way = 1e-5 * i;
      const Wrench now = physics::soft_wrench(contact, {contact.X_WT0.p + way * direction, Quat::Identity()});
      EXPECT_GE(now.f.dot(contact.wrench_W.f), 0) << way;
      EXPECT_LE(now.f.norm(), most_n) << way;
      // Bound of the change of force between two poses 10 µm apart: 10 times the stiffness times this distance. The
      // stiffness alone would give the factor 1. The factor 10 allows for the fading of the force over 15 mm and for
      // the release.
      EXPECT_LT((now.f - before.f).norm(), 1e-5 * 10 * contact.stiffness.norm()) << way;
      before = now;
    }
    EXPECT_EQ(before.f.norm(), 0) << "30 mm away";
    EXPECT_EQ(before.t.norm(), 0);
  }
}

TEST(SoftWrench, PressedDeeperIsASpringThatEnds) {
  SoftContact contact;
  contact.wrench_W.f = Vec3(0, 0, 0.3);
  contact.stiffness(2, 2) = 100;
  contact.trust_radius_m = 0.003;
  const auto force_n = [&](double depth_m) {
    return physics::soft_wrench(contact, {Vec3(0, 0, -depth_m), Quat::Identity()}).f.z();
  };
  EXPECT_NEAR(force_n(0.02), 0.3 + 100 * 0.02, 1e-12) << "far beyond the radius to the sides";
  EXPECT_EQ(force_n(0.06), force_n(0.05));
  EXPECT_EQ(force_n(-0.003), 0) << "out of it";
}

TEST(SoftWrench, IsFiniteForEveryFinitePose) {
  const SoftContact contact = pushing_up();
  for (const double far : {0.0, 1e-300, 1e3, 1e150, 1e300}) {
    EXPECT_TRUE(is_finite(physics::soft_wrench(contact, {Vec3::Constant(far), quaternion_of(Vec3(3, 1, 2))}))) << far;
  }
  EXPECT_EQ(physics::soft_wrench(SoftContact{}, Pose{}).f.norm(), 0);
}

std::string soft_refusal(const std::string& body, const std::string& rest = "") {
  try {
    physics::load_parts({.rest = R"("soft_bodies": [{"name": "pad", )" + body + "}]" + rest});
  } catch (const SceneError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(SoftScene, MistakesAreRefusedInWordsThatLeadToThem) {
  const std::string block = R"("block": {"size_m": [0.08, 0.08, 0.04]})";
  const std::pair<std::string, std::string> cases[] = {
      {soft_refusal(R"("mass_kg": 1)"), "soft_bodies[0] has no kind; it must have one of block, mesh"},
      {soft_refusal(R"("block": {"size_m": [1, 1]})"), "soft_bodies[0].block.size_m has 2 numbers"},
      {soft_refusal(R"("block": {"size_m": [1, 1, 0]})"), "soft_bodies[0].block.size_m[2] is 0"},
      {soft_refusal(R"("block": {"size_m": [1, 1, 1], "spacing_m": 0.05})"),
       "soft_bodies[0].block.spacing_m is 0.05, which makes 9261 nodes; at most 2000 are possible: widen it"},
      {soft_refusal(R"("block": {"size_m": [1, 1, 1], "spacing_m": "NaN"})"), "soft_bodies[0].block.spacing_m is nan"},
      {soft_refusal(block + R"(, "mass_kg": 0)"), "soft_bodies[0].mass_kg is 0"},
      {soft_refusal(block + R"(, "stiffness": 0)"), "soft_bodies[0].stiffness is 0; it must be from 0.001 to 1"},
      {soft_refusal(block + R"(, "damping": 2)"), "soft_bodies[0].damping is 2"},
      {soft_refusal(block + R"(, "volume_stiffness": -1)"), "soft_bodies[0].volume_stiffness is -1"},
      {soft_refusal(block + R"(, "friction": 11)"), "soft_bodies[0].friction is 11"},
      {soft_refusal(block + R"(, "anchored": ["-z", "down"])"),
       "soft_bodies[0].anchored[1] is \"down\"; it must be one of"},
      {soft_refusal(block + R"(, "color_rgb": [1])"), "soft_bodies[0].color_rgb has 1 numbers"},
      {soft_refusal(block, R"(, "soft_step_rate_hz": 29)"),
       "soft_step_rate_hz is 29 Hz; it must be from 30 to 1000 Hz"},
      {soft_refusal(block, R"(, "step_rate_hz": 100, "soft_step_rate_hz": 200)"),
       "soft_step_rate_hz is 200; it must be"},
      {soft_refusal(R"("mesh": {"file": "/x/y.obj"})"), "soft_bodies[0].mesh.file is /x/y.obj, which does not exist"},
      {soft_refusal(block + R"(}, {"name": "pad", )" + block), "soft_bodies[1].name is \"pad\", which is taken"},
  };
  for (const auto& [message, expected] : cases) EXPECT_THAT(message, ::testing::HasSubstr(expected));
  EXPECT_EQ(soft_refusal(block), "accepted");
}

geometry::ContactMesh octahedron(geometry::SurfaceKind kind) {
  geometry::ContactMesh mesh;
  mesh.kind = kind;
  mesh.mesh.vertices = {{0.02, 0, 0}, {-0.02, 0, 0}, {0, 0.02, 0}, {0, -0.02, 0}, {0, 0, 0.02}, {0, 0, -0.02}};
  mesh.mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  return mesh;
}

TEST(SoftScene, OpenOrTooFineSurfaceIsRefused) {
  wire::SoftBody body;
  body.mutable_mesh()->set_file("skin.obj");
  const auto refusal = [&body](const geometry::ContactMesh& mesh) -> std::string {
    try {
      soft_model_of(body, &mesh, SceneField("s.json").in("soft_bodies", 0));
    } catch (const SceneError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal(octahedron(geometry::SurfaceKind::kSheet)),
              ::testing::HasSubstr("soft_bodies[0].mesh.file is skin.obj, which is open"));
  geometry::ContactMesh fine = octahedron(geometry::SurfaceKind::kSolid);
  fine.mesh.vertices.resize(kMaxSoftNodes + 1, Vec3::Zero());
  EXPECT_THAT(refusal(fine), ::testing::HasSubstr("has 2001 vertices; at most 2000 are possible: simplify it"));
}

TEST(SoftScene, ClosedSurfaceKeepsItsVolumeOnATable) {
  SoftTraits traits;
  traits.X_WS.p = Vec3(0, 0, 0.03);
  traits.volume_stiffness = 1;
  SoftWorldSettings settings = pad_settings(0);
  settings.bodies = {make_soft_surface(octahedron(geometry::SurfaceKind::kSolid).mesh, traits)};
  const double volume_m3 = enclosed_volume_m3(settings.bodies[0].nodes_W, settings.bodies[0].faces);
  SoftWorld world(std::move(settings));
  soft_steps(world, kAway, 120);
  const std::vector<Vec3> nodes(world.nodes_W(0).begin(), world.nodes_W(0).end());
  EXPECT_NEAR(enclosed_volume_m3(nodes, world.model(0).faces), volume_m3, 0.1 * volume_m3);
  EXPECT_NEAR(lowest_m(world), 0, 1e-3);
}

TEST(SoftScene, TheNoteStatesTheRateInUse) {
  TANDEM_LOAD_SCENE(scene, "soft_pad");
  EXPECT_THAT(scene->notes,
              ::testing::Contains(::testing::HasSubstr("every 17 steps, at 58.8235 Hz (requested: 60 Hz)")));
}

TEST(SoftScene, ShippedPadIsPressedByItsTool) {
  TANDEM_LOAD_SCENE(scene, "soft_pad");
  ASSERT_EQ(scene->soft_bodies.size(), 1U);
  SoftWorld world(soft_world_settings(*scene));
  std::vector<std::optional<Pose>> tools(scene->world.tools.size() + scene->world.bodies.size());
  for (std::size_t i = 0; i < scene->world.tools.size(); ++i) tools[i] = scene->world.tools[i].X_WT;
  const auto fewest = [&world, &tools](int count) {
    double fastest_s = std::numeric_limits<double>::infinity();
    for (int i = 0; i < count * world.period_steps(); ++i) {
      world.advance(tools);
      // The first result was computed for the previous poses, so its time is not measured.
      if (i > world.period_steps()) fastest_s = std::min(fastest_s, world.last_step_seconds());
    }
    return 1e3 * fastest_s;
  };
  RecordProperty("ms_per_soft_step_untouched", std::to_string(fewest(30)));
  EXPECT_EQ(physics::soft_wrench(world.contact(0), *tools[0]).f.norm(), 0) << "predicted only";
  tools[0]->p.z() = 0.042;
  RecordProperty("ms_per_soft_step_pressed", std::to_string(fewest(30)));
  EXPECT_GT(world.contact(0).wrench_W.f.z(), 0.1);
  EXPECT_LT(world.contact(0).wrench_W.f.z(), 20);
  RecordProperty("newtons_at_8_mm", std::to_string(world.contact(0).wrench_W.f.z()));
  RecordProperty("newtons_per_metre_at_8_mm", std::to_string(world.contact(0).stiffness(2, 2)));
}

}  // namespace
}  // namespace tandem::server
