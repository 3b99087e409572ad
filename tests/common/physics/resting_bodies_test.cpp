// Tests that bodies in static equilibrium stay in place, for any masses and in both stages (touched and untouched
// bodies).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/base/random.hpp"
#include "tests/common/physics/world_support.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::physics {
namespace {

constexpr double kRestMove_m = 2e-4, kRestTurn_rad = 0.2 * std::numbers::pi / 180;

/// Stacked boxes on a sloping table. Gravity is rotated instead of the table.
struct StackCase {
  WorldDescription world;
  std::size_t top = 0;  ///< index of the uppermost body
  double push_m = 0;    ///< height at which the uppermost body is pushed
};

/// Only a few sizes are used, because making a shape takes half a second.
constexpr std::array kSizes_m = {std::array{0.02, 0.03, 0.01}, std::array{0.04, 0.04, 0.04},
                                 std::array{0.06, 0.03, 0.02}, std::array{0.03, 0.05, 0.05},
                                 std::array{0.05, 0.06, 0.01}, std::array{0.025, 0.02, 0.03}};

BodyDescription box(std::size_t kind, const Vec3& p, double mass_kg, double friction) {
  static const auto shapes = [] {
    std::vector<std::shared_ptr<const contact::ContactShape>> made;
    for (const auto& size : kSizes_m) made.push_back(contact::make_contact_box({size[0], size[1], size[2]}));
    return made;
  }();
  const Vec3 size(kSizes_m.at(kind).data());
  BodyDescription body;
  body.touch = touch_of(shapes.at(kind));
  const Vec3 squares = size.cwiseAbs2();
  body.mass = {mass_kg, Pose{},
               mass_kg / 12 * Vec3(squares.y() + squares.z(), squares.x() + squares.z(), squares.x() + squares.y())};
  body.traits.friction = friction;
  body.X_WB.p = p;
  return body;
}

/// Returns a random stable stack. The slope is at most half of the friction angle. For each box, the line of gravity
/// through it and all boxes above it passes through the middle half of its support.
StackCase stack_of(Random& random) {
  for (;;) {
    const int count = 2 + static_cast<int>(random.uniform(0, 4.999));
    const double friction = random.uniform(0.3, 1);
    const double slope = random.uniform(0, 0.5 * std::atan(friction));
    const double towards = random.uniform(0, 2 * std::numbers::pi);
    const Vec3 down(std::sin(slope) * std::cos(towards), std::sin(slope) * std::sin(towards), -std::cos(slope));
    StackCase made;
    BodyDescription ground = table();
    ground.traits.friction = friction;
    std::vector<BodyDescription> boxes;
    std::vector<Vec3> sizes;
    double top_m = 0;
    Vec3 place = Vec3::Zero();
    for (int i = 0; i < count; ++i) {
      const auto kind = static_cast<std::size_t>(random.uniform(0, static_cast<double>(kSizes_m.size())));
      const Vec3 size(kSizes_m.at(kind).data());
      const double mass_kg = 0.05 * std::pow(10.0, random.uniform(-1.5, 1.5));
      if (i > 0) place += Vec3(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), 0);
      boxes.push_back(box(kind, {place.x(), place.y(), top_m + size.z() / 2}, mass_kg, friction));
      sizes.push_back(size);
      top_m += size.z();
    }
    bool stands = true;
    Vec3 moment = Vec3::Zero();
    double mass_kg = 0;
    for (std::size_t i = boxes.size(); i-- > 0;) {
      mass_kg += boxes[i].mass.mass_kg;
      moment += boxes[i].mass.mass_kg * boxes[i].X_WB.p;
      const Vec3 centre = moment / mass_kg;
      const double foot_m = boxes[i].X_WB.p.z() - sizes[i].z() / 2;
      const Vec3 met = centre + (centre.z() - foot_m) / -down.z() * down;
      for (int axis = 0; axis < 2; ++axis) {
        const double own = 0.25 * sizes[i][axis];
        double low = boxes[i].X_WB.p[axis] - own, high = boxes[i].X_WB.p[axis] + own;
        if (i > 0) {
          const double below = 0.25 * sizes[i - 1][axis];
          low = std::max(low, boxes[i - 1].X_WB.p[axis] - below);
          high = std::min(high, boxes[i - 1].X_WB.p[axis] + below);
        }
        stands = stands && met[axis] > low && met[axis] < high;
      }
    }
    if (!stands) continue;
    made.top = boxes.size();
    made.push_m = boxes.back().X_WB.p.z();
    boxes.insert(boxes.begin(), ground);
    const Vec3 beside = boxes.back().X_WB.p - Vec3(sizes.back().x() / 2 + kBallRadius_m + 2e-3, 0, 0);
    made.world = world_of(std::move(boxes), {ball_tool(beside)});
    made.world.gravity_m_per_s2 = 9.81 * down;
    made.world.coupling.parameters.stiffness_n_per_m = 300;
    made.world.coupling.parameters.damping_n_s_per_m = 5;
    return made;
  }
}

std::vector<Pose> poses_of(const World& world, std::size_t bodies) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < bodies; ++i) poses.push_back(world.body(BodyId{static_cast<std::uint32_t>(i + 1)}).X);
  return poses;
}

/// Returns the largest distance and the largest angle between corresponding poses.
std::pair<double, double> difference(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  double move_m = 0, turn_rad = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    move_m = std::max(move_m, (a[i].p - b[i].p).norm());
    turn_rad = std::max(turn_rad, rotation_vector(a[i].q * b[i].q.conjugate()).norm());
  }
  return {move_m, turn_rad};
}

void keep_all_touched(World& world, std::size_t bodies) {
  for (std::size_t i = 0; i < bodies; ++i) world.keep_implicit(BodyId{static_cast<std::uint32_t>(i + 1)}, 3600);
}

/// Pushes the uppermost body sideways with 0.1 N for 0.3 s with a tool, and then withdraws the tool.
void nudge(World& world, const StackCase& stack) {
  const Vec3 beside = stack.world.tools[0].X_WT.p;
  const double pushing_m = 2e-3 + 0.1 / 300;
  world.activate_tool(0);
  for (int i = 0; i < 900; ++i) {
    const double share = i < 300 ? i / 300.0 : i < 600 ? 1 : (900 - i) / 300.0;
    world.set_handle(0, at(beside + Vec3(share * pushing_m, 0, 0)));
    world.step();
  }
  world.deactivate_tool(0);
}

void check_stacks(int count, double seconds) {
  const std::uint64_t seed = test::test_seed(601);
  Random random(seed);
  double worst_m = 0, worst_rad = 0, worst_nudged_m = 0;
  for (int i = 0; i < count; ++i) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", stack " + std::to_string(i));
    const StackCase stack = stack_of(random);
    const std::size_t bodies = stack.world.bodies.size();
    World world = server_world(stack.world), touched = server_world(stack.world);
    keep_all_touched(touched, bodies);
    const std::vector<Pose> start = poses_of(world, bodies);
    EXPECT_EQ(run(world, static_cast<int>(500 * seconds)), 0U);
    const auto [move_m, turn_rad] = difference(poses_of(world, bodies), start);
    EXPECT_LT(move_m, kRestMove_m);
    EXPECT_LT(turn_rad, kRestTurn_rad);
    run(touched, 1000);
    // A push of 0.1 N may displace a light body. The body must then end in the same pose in `world`, where it may
    // sleep, and in `touched`, where the touch stage moves it.
    nudge(world, stack);
    nudge(touched, stack);
    run(world, static_cast<int>(500 * seconds));
    run(touched, 1000);
    const auto [nudged_m, nudged_rad] = difference(poses_of(world, bodies), poses_of(touched, bodies));
    EXPECT_LT(nudged_m, kRestMove_m);
    EXPECT_LT(nudged_rad, kRestTurn_rad);
    worst_m = std::max(worst_m, move_m);
    worst_rad = std::max(worst_rad, turn_rad);
    worst_nudged_m = std::max(worst_nudged_m, nudged_m);
  }
  std::cout << "moved by " << 1e3 * worst_m << " mm and " << worst_rad * 180 / std::numbers::pi
            << " degrees at most; after a nudge " << 1e3 * worst_nudged_m << " mm from the touch stage alone\n";
}

TEST(RestingBodies, StacksStayWhereStaticsHoldsThem) {
  check_stacks(20, 4);
}

TEST(RestingBodies, TwoHundredStacksStayForTenSeconds) {
  check_stacks(200, 10);
}

/// Returns the largest displacement and rotation of any body in 10 s, in the world of a server.
std::pair<double, double> moved_in_ten_seconds(const WorldDescription& description) {
  World world = server_world(description);
  run(world, 500);
  const std::vector<Pose> start = poses_of(world, description.bodies.size());
  run(world, 10'000);
  return difference(poses_of(world, description.bodies.size()), start);
}

TEST(RestingBodies, ALeaningPlankStaysWhereFrictionHoldsIt) {
  // Static limit of a uniform plank that leans on a wall, with the friction coefficient µ at floor and wall: the
  // tangent of its angle with the floor must be above (1 − µ²) / 2µ.
  constexpr double kFriction = 0.6, kLength_m = 0.06;
  const double steep_rad = std::atan((1 - kFriction * kFriction) / (2 * kFriction));
  for (const double margin_rad : {0.1, 0.3, 0.5}) {
    const double angle = steep_rad + margin_rad;
    BodyDescription wall = table();
    wall.X_WB = {{0.05, 0, 0}, quaternion_of({0, std::numbers::pi / 2, 0})};
    BodyDescription plank = box(2, {0, 0, 0}, 0.05, kFriction);
    const double half_m = kLength_m / 2, thick_m = 0.01;
    // The lower edge is on the floor. The upper edge touches the wall, whose face is at x = 0.
    plank.X_WB.q = quaternion_of({0, -angle, 0});
    plank.X_WB.p = {-half_m * std::cos(angle) - thick_m * std::sin(angle), 0,
                    half_m * std::sin(angle) + thick_m * std::cos(angle)};
    WorldDescription description = world_of({table(), wall, plank}, {ball_tool({0, 0, 2})});
    description.gravity_m_per_s2 = {0, 0, -9.81};
    for (BodyDescription& body : description.bodies) body.traits.friction = kFriction;
    const auto [move_m, turn_rad] = moved_in_ten_seconds(description);
    EXPECT_LT(move_m, kRestMove_m) << margin_rad;
    EXPECT_LT(turn_rad, kRestTurn_rad) << margin_rad;
    EXPECT_GT(server_world(description).body(BodyId{3}).X.p.z(), 0.01);
  }
}

TEST(RestingBodies, ALightBodyRestsOnAHeavyOneThatHangsOnAnAnchor) {
  for (const double light_kg : {0.001, 0.05}) {
    WorldDescription description =
        world_of({box(1, {0, 0, 0}, 1, 0.5), box(0, {0.005, 0, 0.025}, light_kg, 0.5)}, {ball_tool({0, 0, 2})});
    description.bodies[0].anchor = Joint{2000, 60, 5, 0.05};
    description.gravity_m_per_s2 = {0.5, 0, -9.81};
    World world = server_world(description);
    run(world, 3000);
    const std::vector<Pose> start = poses_of(world, 2);
    run(world, 10'000);
    const auto [move_m, turn_rad] = difference(poses_of(world, 2), start);
    EXPECT_LT(move_m, kRestMove_m) << light_kg;
    EXPECT_LT(turn_rad, kRestTurn_rad) << light_kg;
    EXPECT_NEAR(start[0].p.z(), -(1 + light_kg) * 9.81 / 2000, 2e-5);
    EXPECT_NEAR((start[1].p - start[0].p).z(), 0.025, 2e-5);
  }
}

/// A heavy body is set down on a lighter one. It must end in the same pose as in a world where the touch stage moves it
/// at all times.
TEST(RestingBodies, AHeavyBodyThatIsSetDownOnALightOneStays) {
  for (const double light_kg : {0.005, 0.05}) {
    WorldDescription description = world_of(
        {table(), box(1, {0, 0, 0.02}, light_kg, 0.8), box(1, {0.003, 0, 0.065}, 1, 0.8)}, {ball_tool({0, 0, 0.3})});
    description.gravity_m_per_s2 = {0, 0, -9.81};
    description.bodies[0].traits.friction = 0.8;
    description.bodies[2].is_graspable = true;
    description.tools[0].X_WT.p = {0.003, 0, 0.09};
    description.tools[0].holds_body = 2;
    std::vector<std::vector<Pose>> ends;
    for (const bool is_touched : {false, true}) {
      World world = server_world(description);
      if (is_touched) keep_all_touched(world, 3);
      world.activate_tool(0);
      for (int i = 0; i < 1000; ++i) {
        world.set_handle(0, at({0.003, 0, 0.09 - 0.02 * std::min(1.0, i / 800.0)}));
        world.step();
      }
      world.deactivate_tool(0);
      run(world, is_touched ? 2000 : 10'000);
      ends.push_back(poses_of(world, 3));
    }
    const auto [move_m, turn_rad] = difference(ends[0], ends[1]);
    EXPECT_LT(move_m, kRestMove_m) << light_kg;
    EXPECT_LT(turn_rad, kRestTurn_rad) << light_kg;
    EXPECT_NEAR(ends[0][2].p.z(), 0.06, 1e-4) << "the heavy body must rest on the light one";
  }
}

/// A ball with restitution above a table.
WorldDescription dropped_ball(double restitution, double height_m) {
  BodyDescription ball;
  ball.touch = touch_of(contact::make_contact_sphere(0.02));
  ball.mass = mass_of(0.1, 0.02 * std::sqrt(0.4));
  ball.traits.restitution = restitution;
  ball.X_WB.p = {0, 0, 0.02 + height_m};
  WorldDescription world = world_of({table(), ball}, {ball_tool({0, 0, 2})});
  world.gravity_m_per_s2 = {0, 0, -9.81};
  return world;
}

TEST(RestingBodies, ABallBouncesToTheHeightOfItsRestitution) {
  constexpr double kHeight_m = 0.2;
  for (const double restitution : {0.0, 0.3, 0.7, 0.95}) {
    World world = server_world(dropped_ball(restitution, kHeight_m));
    const int fall = static_cast<int>(std::sqrt(2 * kHeight_m / 9.81) / kStep_s);
    EXPECT_EQ(run(world, fall + 30), 0U);
    double highest_m = 0;
    for (int i = 0; i < 400 && world.body(BodyId{2}).V.v.z() > -0.05; ++i) {
      world.step();
      highest_m = std::max(highest_m, world.body(BodyId{2}).X.p.z() - 0.02);
    }
    EXPECT_NEAR(highest_m, restitution * restitution * kHeight_m, 0.02 * kHeight_m) << restitution;
    run(world, 20'000);
    EXPECT_EQ(world.body(BodyId{2}).V.v.norm(), 0) << restitution << ": it sleeps";
    EXPECT_NEAR(world.body(BodyId{2}).X.p.z(), 0.02, 1e-4);
  }
}

TEST(RestingBodies, AHeadOnImpactKeepsMomentumAndHasItsRestitution) {
  for (const double restitution : {0.0, 0.5, 0.9}) {
    for (const double other_kg : {0.01, 0.1, 3.0}) {
      WorldDescription description = dropped_ball(restitution, 0);
      description.gravity_m_per_s2.setZero();
      BodyDescription other = description.bodies[1];
      other.mass = mass_of(other_kg, 0.02 * std::sqrt(0.4));
      other.X_WB.p.x() += 0.06;
      description.bodies[0].X_WB.p.z() -= 1;
      description.bodies.push_back(other);
      World world = server_world(description);
      world.set_body(BodyId{2}, at(description.bodies[1].X_WB.p, {1, 0, 0}));
      run(world, 80);
      const double a = world.body(BodyId{2}).V.v.x(), b = world.body(BodyId{3}).V.v.x();
      EXPECT_NEAR(0.1 * a + other_kg * b, 0.1, 1e-6);
      // Expected: the restitution times the speed of the impact. Even without restitution, the soft contact layer
      // returns up to 0.12 of the speed.
      EXPECT_NEAR(b - a, std::max(restitution, 0.06), 0.06) << restitution << ", " << other_kg << " kg";
    }
  }
}

/// Result for a dumbbell that meets the table with both balls in the same step. The balls are two shapes of one body,
/// so the pair of dumbbell and table has two contact patches. If `turn_rad_per_s` is positive, the second ball is
/// faster than the first one.
struct Parting {
  double met_m_per_s = 0, parted_m_per_s = 0;  ///< speed of the middle before and after the impact
};
Parting dropped_dumbbell(double turn_rad_per_s) {
  constexpr double kArm_m = 0.03, kRadius_m = 0.01, kSpeed_m_per_s = 0.5;
  WorldDescription description = dropped_ball(0.8, 0);
  BodyDescription& body = description.bodies[1];
  const auto ball = contact::make_contact_sphere(kRadius_m);
  body.touch.parts.clear();
  for (const double side : {-1.0, 1.0}) body.touch.parts.push_back({ball, {{side * kArm_m, 0, 0}, Quat::Identity()}});
  body.touch.radius_m = kArm_m + kRadius_m;
  // The radius of gyration equals the distance of the balls from the middle. An impact at one ball then does not move
  // the other ball.
  body.mass = mass_of(0.1, kArm_m);
  description.gravity_m_per_s2.setZero();
  World world = server_world(description);
  const double z = kRadius_m - 1e-6;  // both balls press in the first step
  world.set_body(BodyId{2}, {{{0, 0, z}, Quat::Identity()}, {{0, 0, -kSpeed_m_per_s}, {0, turn_rad_per_s, 0}}});
  run(world, 40);
  return {kSpeed_m_per_s, world.body(BodyId{2}).V.v.z()};
}

TEST(RestingBodies, ABodyOfTwoShapesBouncesWithTheSpeedOfBoth) {
  const Parting level = dropped_dumbbell(0);
  EXPECT_NEAR(level.parted_m_per_s, 0.8 * level.met_m_per_s, 0.02 * level.met_m_per_s);
  // The balls meet the table at 0.04 and 0.96 m/s. The slow ball alone would not bounce. Fails if it prevents the
  // bounce of the body.
  for (const double turn : {-0.46 / 0.03, 0.46 / 0.03}) {
    const Parting turning = dropped_dumbbell(turn);
    EXPECT_GT(turning.parted_m_per_s, 0.3 * turning.met_m_per_s) << turn << " rad/s";
  }
}

TEST(RestingBodies, ASleepingBodyReceivesTheMomentumOfAnImpact) {
  for (const double other_kg : {0.01, 0.1, 3.0}) {
    WorldDescription description =
        world_of({cube({0, 0, 0}, 0.1), cube({0.1, 0, 0}, other_kg)}, {ball_tool({0, 0, 2})});
    World world = server_world(description);
    run(world, 1000);
    world.set_body(BodyId{1}, at({0, 0, 0}, {1, 0, 0}));
    run(world, 100);
    const double a = world.body(BodyId{1}).V.v.x(), b = world.body(BodyId{2}).V.v.x();
    EXPECT_NEAR(0.1 * a + other_kg * b, 0.1, 1e-6) << other_kg;
    EXPECT_GE(b - a, -1e-6) << other_kg;
  }
}

/// The stage stores each pair of bodies in an order, which is reversed when an impact wakes one of them. The bounce
/// must not depend on this order.
TEST(RestingBodies, AnImpactWakesASleepingBodyWithTheSameBounceInEitherOrder) {
  for (const double restitution : {0.5, 0.9}) {
    for (const double other_kg : {0.1, 3.0}) {
      std::array<double, 2> parting{};
      for (const bool comes_first : {true, false}) {
        WorldDescription description = dropped_ball(restitution, 0);
        description.gravity_m_per_s2.setZero();
        description.bodies.erase(description.bodies.begin());
        BodyDescription other = description.bodies[0];
        other.mass = mass_of(other_kg, 0.02 * std::sqrt(0.4));
        other.X_WB.p.x() += 0.06;
        const Vec3 start = description.bodies[0].X_WB.p;
        description.bodies.insert(comes_first ? description.bodies.end() : description.bodies.begin(), other);
        World world = server_world(description);
        run(world, 1000);
        const BodyId moving{comes_first ? 1U : 2U}, struck{comes_first ? 2U : 1U};
        world.set_body(moving, at(start, {1, 0, 0}));
        run(world, 80);
        const double a = world.body(moving).V.v.x(), b = world.body(struck).V.v.x();
        EXPECT_NEAR(0.1 * a + other_kg * b, 0.1, 1e-6);
        EXPECT_NEAR(b - a, restitution, 0.06)
            << restitution << ", " << other_kg << " kg, moving first: " << comes_first;
        parting[comes_first ? 0 : 1] = b - a;
      }
      EXPECT_NEAR(parting[0], parting[1], 0.01) << restitution << ", " << other_kg << " kg";
    }
  }
}

}  // namespace
}  // namespace tandem::physics
