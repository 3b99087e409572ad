// Tests shipped scenes in motion: bitwise reproducibility, and the forces and poses of typical interactions.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fstream>

#include "common/base/random.hpp"
#include "proto/placement.hpp"
#include "server/room/server_world.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::physics {
namespace {

RigidState pose_at(const Vec3& p) {
  return {{p, Quat::Identity()}, Twist{}};
}

/// Returns the FNV-1a hash of the bits of every body's and tool's state.
std::uint64_t state_hash(const World& world, std::size_t bodies, std::size_t tools) {
  std::uint64_t hash = 14695981039346656037ULL;
  const auto add = [&hash](const RigidState& state) {
    for (const double* values : {state.X.p.data(), state.V.v.data(), state.V.w.data()}) {
      for (int i = 0; i < 3; ++i) hash = (hash ^ std::bit_cast<std::uint64_t>(values[i])) * 1099511628211ULL;
    }
    for (int i = 0; i < 4; ++i) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(state.X.q.coeffs()[i])) * 1099511628211ULL;
    }
  };
  for (std::size_t i = 0; i < bodies; ++i) add(world.body(body_id_at(i)));
  for (std::size_t i = 0; i < tools; ++i) add(world.tool(i).tool);
  return hash;
}

/// Two hands push, grab, carry and drop the boxes of a shipped scene; the seed determines their motion. Returns the
/// hash of all states.
std::uint64_t hash_of_session(const std::shared_ptr<const server::LoadedScene>& scene, std::uint64_t seed) {
  Random random(seed);
  World world(server::make_server_world(scene));
  for (const std::size_t tool : {0U, 1U}) world.activate_tool(tool);
  std::array<Vec3, 2> hands{Vec3(-0.08, 0, 0.09), Vec3(0.08, 0, 0.09)};
  for (int i = 0; i < 3000; ++i) {
    for (const std::size_t tool : {0U, 1U}) {
      hands[tool] += 2e-4 * Vec3(random.normal(), random.normal(), random.normal() - 0.2 * (hands[tool].z() > 0.05));
      world.set_handle(tool, pose_at(hands[tool]));
      if (i % 700 == 600) world.grab(tool, BodyId{});
      if (i % 700 == 100) world.release(tool);
    }
    world.step();
  }
  return state_hash(world, scene->world.bodies.size(), 2);
}

TEST(World, SameInputsGiveTheSameBits) {
  TANDEM_LOAD_SCENE(scene, "two_boxes");
  EXPECT_EQ(hash_of_session(scene, 1), hash_of_session(scene, 1));
  EXPECT_NE(hash_of_session(scene, 1), hash_of_session(scene, 2)) << "the hash must see the motion";
}

TEST(ShippedScenes, PegGoesIntoTheHoleInTwoHands) {
  TANDEM_LOAD_SCENE(scene, "peg_in_hole");
  World world(server::make_server_world(scene));
  const auto lead = [&world](const Vec3& offset) {
    world.set_handle(0, pose_at(Vec3(-0.04, -0.01, 0.12) + offset));
    world.set_handle(1, pose_at(Vec3(-0.04, 0.01, 0.12) + offset));
    world.step();
  };
  for (const std::size_t tool : {0U, 1U}) world.activate_tool(tool);
  for (int i = 0; i <= 1000; ++i) lead({1e-4 * i, 0, 0});
  for (int i = 0; i <= 800; ++i) lead({0.1, 0, -1e-4 * i});
  for (int i = 0; i < 500; ++i) lead({0.1, 0, -0.08});
  const RigidState peg = world.body(BodyId{3});
  // The peg of 60 mm stands on the table inside the hole of the block, so its centre is at 30 mm.
  EXPECT_NEAR(peg.X.p.z(), 0.03, 5e-4);
  EXPECT_LT(peg.V.v.norm(), 1e-3);
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - along * (b - a)).norm();
}
double distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  const auto is_inside = [&](const Vec3& from, const Vec3& to) { return n.cross(to - from).dot(p - from) >= 0; };
  if (is_inside(a, b) && is_inside(b, c) && is_inside(c, a)) return std::abs(n.dot(p - a)) / n.norm();
  return std::min({distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
}
/// Returns the distance to the nearest of all triangles. This slow reference is independent of the world's algorithm.
double distance_to_mesh(const Vec3& p, const geometry::TriangleMesh& mesh) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [i, j, k] : mesh.triangles) {
    const auto at_index = [&mesh](int index) { return mesh.vertices[static_cast<std::size_t>(index)]; };
    nearest = std::min(nearest, distance_to_triangle(p, at_index(i), at_index(j), at_index(k)));
  }
  return nearest;
}

TEST(ShippedScenes, ToolLiesOnTheBunnyAndNotInIt) {
  TANDEM_LOAD_SCENE(scene, "bunny");
  World world(server::make_server_world(scene));
  world.activate_tool(0);
  const server::SolidShape& bunny = scene->body_shapes[1][0];
  const Pose X_SW = (scene->world.bodies[1].X_WB * proto::pose_from_placement(bunny.shape.placement())).inverse();
  double nearest = 1, strongest_n = 0;
  for (int i = 0; i <= 1500; ++i) {
    // The handle moves from the left to the centre of the bunny, so the tool presses on the surface.
    world.set_handle(0, pose_at({-0.1 + 1e-4 * std::min(i, 1000), 0, 0.05}));
    world.step();
    strongest_n = std::max(strongest_n, world.tool(0).wrench_on_hand_W.f.norm());
    if (i % 50 == 0) nearest = std::min(nearest, distance_to_mesh(X_SW * world.tool(0).tool.X.p, *bunny.mesh));
  }
  EXPECT_GT(strongest_n, 2) << "the tool must have been pressed against it";
  // The tool has a radius of 5 mm. It penetrates the surface until the contact pressure balances the hand's force.
  EXPECT_GT(nearest, 0.0045);
  EXPECT_LT(nearest, 0.0050);
}

TEST(ShippedScenes, TwoBunniesPressOnEachOtherEquallyAndCalmly) {
  TANDEM_LOAD_SCENE(scene, "two_bunnies");
  World world(server::make_server_world(scene));
  for (const std::size_t tool : {0U, 1U}) world.activate_tool(tool);
  for (int i = 0; i <= 4000; ++i) {
    world.set_handle(0, pose_at({0, 0, 0.05}));
    world.set_handle(1, pose_at({0.03, 0, 0.15 - 2e-5 * std::min(i, 2500)}));
    world.step();
  }
  EXPECT_GT(world.touch(0).contacts, 3U);
  EXPECT_NEAR(world.touch(0).force_n, world.touch(1).force_n, 1e-9) << "action and reaction";
  EXPECT_GT(world.touch(0).force_n, 0.5);
  EXPECT_LT(world.touch(0).deepest_m, 5e-4);
  for (const std::uint32_t body : {1U, 2U}) EXPECT_LT(world.body(BodyId{body}).V.v.norm(), 1e-3) << body;
}

TEST(ShippedScenes, SoftPadPushesBackMoreTheDeeperItIsPressed) {
  TANDEM_LOAD_SCENE(scene, "soft_pad");
  World world(server::make_server_world(scene));
  world.activate_tool(0);
  std::array<double, 3> force_n{};
  // The top of the pad is at 40 mm. The ball has a radius of 10 mm.
  for (std::size_t level = 0; level < force_n.size(); ++level) {
    const double z = 0.055 - 0.008 * static_cast<double>(level);
    for (int i = 0; i < 1500; ++i) {
      world.set_handle(0, pose_at({-0.02, 0, z}));
      world.step();
    }
    force_n[level] = world.tool(0).wrench_on_hand_W.f.z();
    EXPECT_LT(world.tool(0).tool.V.v.norm(), 2e-3) << level;
  }
  EXPECT_NEAR(force_n[0], 0, 1e-3) << "above the pad";
  EXPECT_GT(force_n[1], 0.1);
  EXPECT_GT(force_n[2], 1.5 * force_n[1]);
  EXPECT_NEAR(world.touch(0).soft_force_n, force_n[2], 0.1 * force_n[2])
      << "the force on the hand must equal the force of the pad";
}

TEST(ShippedScenes, HelicesPullEachOtherTogetherAndRest) {
  TANDEM_LOAD_SCENE(scene, "docking_helices");
  World world(server::make_server_world(scene));
  world.step();
  const double start = world.stored_energy_j();
  double highest = start;
  for (int i = 0; i < 3000; ++i) {
    world.step();
    highest = std::max(highest, world.stored_energy_j());
  }
  // Field energy and velocity are computed for times half a step apart. The tolerance is |F| v h/2.
  EXPECT_LE(highest, start + 1e-4);
  EXPECT_LT(world.field_energy_kj_per_mol(), 0);
}

}  // namespace
}  // namespace tandem::physics
