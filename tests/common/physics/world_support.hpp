// Small worlds for tests, built from plain data.
#pragma once

#include "common/contact/contact_shape.hpp"
#include "common/physics/followed_bodies.hpp"
#include "common/physics/untouched_bodies.hpp"
#include "common/physics/world.hpp"
#include "tests/common/physics/external_bodies.hpp"

namespace tandem::physics {

inline constexpr double kStep_s = 1e-3;
inline constexpr double kCubeEdge_m = 0.04;
inline constexpr double kBallRadius_m = 0.005;
inline constexpr double kToolMass_kg = 0.05;

inline TouchModel touch_of(std::shared_ptr<const contact::ContactShape> shape) {
  const double radius = shape->radius_m();
  return {{{std::move(shape), Pose{}}}, radius};
}

inline MassProperties mass_of(double mass_kg, double gyration_m, const Vec3& centre_B = Vec3::Zero()) {
  return {mass_kg, {centre_B, Quat::Identity()}, Vec3::Constant(mass_kg * gyration_m * gyration_m)};
}

inline RigidState at(const Vec3& p, const Vec3& v = Vec3::Zero()) {
  return {{p, Quat::Identity()}, {v, Vec3::Zero()}};
}

/// Returns a cube with an edge of 4 cm. It is static if `mass_kg` is 0.
inline BodyDescription cube(const Vec3& p, double mass_kg) {
  static const auto shape = contact::make_contact_box(Vec3::Constant(kCubeEdge_m));
  BodyDescription body;
  body.touch = touch_of(shape);
  if (mass_kg > 0) body.mass = mass_of(mass_kg, kCubeEdge_m / std::sqrt(6.0));
  body.X_WB.p = p;
  body.is_graspable = mass_kg > 0;
  return body;
}

inline BodyDescription table() {
  static const auto shape = contact::make_contact_box({1, 1, 0.1});
  BodyDescription body;
  body.touch = touch_of(shape);
  body.X_WB.p = {0, 0, -0.05};
  return body;
}

/// Returns a tool: a ball with a radius of 5 mm and a mass of 50 g.
inline ToolDescription ball_tool(const Vec3& p) {
  static const auto shape = contact::make_contact_sphere(kBallRadius_m);
  ToolDescription tool;
  tool.touch = touch_of(shape);
  tool.mass = mass_of(kToolMass_kg, 0.015);
  tool.X_WT.p = p;
  return tool;
}

/// Returns the description of a world with the linear coupling and without gravity.
inline WorldDescription world_of(std::vector<BodyDescription> bodies, std::vector<ToolDescription> tools) {
  WorldDescription world;
  world.gravity_m_per_s2 = Vec3::Zero();
  world.bodies = std::move(bodies);
  world.tools = std::move(tools);
  world.coupling.law = "spring-damper";
  world.coupling.parameters.force_limit_n = 100;
  world.coupling.parameters.torque_limit_n_m = 10;
  return world;
}

/// Returns the world of a client, whose bodies follow the last received states.
inline World client_world(const WorldDescription& description, ExternalBodies* external = nullptr) {
  std::unique_ptr<FreeBodies> engine = make_followed_bodies(description.bodies.size());
  if (external != nullptr) engine = watched(std::move(engine), *external);
  return {std::make_shared<const WorldDescription>(description), std::move(engine), nullptr};
}
/// Returns the world of a server, whose untouched bodies are moved by the contact solver.
inline World server_world(const WorldDescription& description, ExternalBodies* external = nullptr) {
  auto kept = std::make_shared<const WorldDescription>(description);
  std::unique_ptr<FreeBodies> engine = make_untouched_bodies(*kept);
  if (external != nullptr) engine = watched(std::move(engine), *external);
  return {std::move(kept), std::move(engine), nullptr};
}

inline TickFaults run(World& world, int steps) {
  TickFaults faults = 0;
  for (int i = 0; i < steps; ++i) faults |= world.step();
  return faults;
}

}  // namespace tandem::physics
