// Soft pad on a table, and a ball that presses it, for tests of soft bodies.
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

/// Returns the shape of the table. It is built once, because it has a hundred thousand points.
inline const std::shared_ptr<const contact::ContactShape>& table_shape() {
  static const auto kShape = contact::make_contact_box(Vec3(0.5, 0.4, 0.02));
  return kShape;
}

/// Returns settings with a pad on a table whose top is at z = 0, and a ball as the only tool.
inline SoftWorldSettings pad_settings(SoftSides anchored, double friction = 0.5) {
  SoftTraits traits;
  traits.mass_kg = 0.3;
  traits.anchored = anchored;
  traits.X_WS.p = Vec3(0, 0, kPadHeight_m / 2);
  SoftWorldSettings settings;
  // The worker is the thread that steps the soft bodies. Tests run faster than real time, so results are reproducible
  // only if the room waits for the worker.
  settings.waits_for_worker = true;
  settings.bodies.push_back(make_soft_block(Vec3(0.08, 0.08, kPadHeight_m), 0.0134, traits));
  settings.obstacles.push_back(rigid(table_shape(), 0.5, {Vec3(0, 0, -0.01), Quat::Identity()}));
  settings.tools.push_back(rigid(contact::make_contact_sphere(kBallRadius_m), friction));
  return settings;
}
/// Returns the settings of the pad without table and gravity.
inline SoftWorldSettings floating_settings() {
  SoftWorldSettings settings = pad_settings(0);
  settings.obstacles.clear();
  settings.gravity_m_per_s2 = Vec3::Zero();
  return settings;
}

inline Pose ball_at(const Vec3& p_W) {
  return {p_W, Quat::Identity()};
}
/// Returns the pose of a ball whose lowest point is `depth_m` below the top of the pad. The ball is off the centre, so
/// that symmetry does not hide components.
inline Pose ball_in_pad(double depth_m) {
  return ball_at(Vec3(0.003, 0.002, kPadHeight_m + kBallRadius_m - depth_m));
}
inline const Pose kAway = ball_at(Vec3(0, 0, 0.3));

/// Makes one step of the room with the tool at `X_WT`. If `X_WT` is empty, there is no tool.
inline TickFaults room_step(SoftWorld& world, const std::optional<Pose>& X_WT) {
  return world.advance({&X_WT, 1});
}
/// Makes the steps of the room that belong to one soft step, with the tool at `X_WT`. When the function returns, the
/// room uses the result of this soft step.
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
