// A pad on a table and a ball that presses it, for the tests of soft bodies.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "common/contact/field/primitive_fields.hpp"
#include "server/assets/soft_scene.hpp"
#include "server/physics/soft_world.hpp"

namespace tandem::server {

inline constexpr double kBallRadius_m = 0.015;
inline constexpr double kPadHeight_m = 0.04;

inline SoftRigid rigid(std::shared_ptr<const contact::ContactShape> shape, double friction, const Pose& X_WT = {}) {
  SoftRigid result;
  result.model.radius_m = shape->radius_m();
  result.model.parts.push_back({std::move(shape), Pose{}});
  result.friction = friction;
  result.X_WT = X_WT;
  return result;
}

/// The table is built once, because it has a hundred thousand points, which no test needs.
inline const std::shared_ptr<const contact::ContactShape>& table_shape() {
  static const auto kShape = contact::make_contact_box(Vec3(0.5, 0.4, 0.02));
  return kShape;
}

/// Settings with a pad on a table whose top is z = 0, and a ball as the tool.
inline SoftWorldSettings pad_settings(SoftSides anchored, double friction = 0.5) {
  SoftTraits traits;
  traits.mass_kg = 0.3;
  traits.anchored = anchored;
  traits.X_WS.p = Vec3(0, 0, kPadHeight_m / 2);
  SoftWorldSettings settings;
  // The tests run faster than real time, so the room must wait for the worker.
  settings.waits_for_worker = true;
  settings.bodies.push_back(make_soft_block(Vec3(0.08, 0.08, kPadHeight_m), 0.0134, traits));
  settings.obstacles.push_back(rigid(table_shape(), 0.5, {Vec3(0, 0, -0.01), Quat::Identity()}));
  settings.tools.push_back(rigid(contact::make_contact_sphere(kBallRadius_m), friction));
  return settings;
}
/// The same pad without table and gravity.
inline SoftWorldSettings floating_settings() {
  SoftWorldSettings settings = pad_settings(0);
  settings.obstacles.clear();
  settings.gravity_m_per_s2 = Vec3::Zero();
  return settings;
}

inline Pose ball_at(const Vec3& p_W) {
  return {p_W, Quat::Identity()};
}
/// Pose of a ball that is `depth_m` below the top of the pad. It is off the centre, so that no components cancel by
/// symmetry.
inline Pose ball_in_pad(double depth_m) {
  return ball_at(Vec3(0.003, 0.002, kPadHeight_m + kBallRadius_m - depth_m));
}
inline const Pose kAway = ball_at(Vec3(0, 0, 0.3));

/// Runs one step of the room with the tool at `X_WT`. If it is empty, the tool is absent.
inline TickFaults room_step(SoftWorld& world, const std::optional<Pose>& X_WT) {
  return world.advance({&X_WT, 1});
}
/// Runs one soft step. Its result can be read afterwards, because the next soft step uses the same pose of the tool.
inline TickFaults soft_step(SoftWorld& world, const std::optional<Pose>& X_WT) {
  TickFaults faults = 0;
  for (int i = 0; i < world.period_steps(); ++i) faults |= room_step(world, X_WT);
  return faults;
}
inline void soft_steps(SoftWorld& world, const std::optional<Pose>& X_WT, int count) {
  for (int i = 0; i < count; ++i) soft_step(world, X_WT);
}
inline Vec6 as_vector(const Wrench& wrench) {
  Vec6 vector;
  vector << wrench.f, wrench.t;
  return vector;
}

}  // namespace tandem::server
