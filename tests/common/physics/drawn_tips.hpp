// Support for tests in which a tool tip presses on a surface while the hand moves it along the surface.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "common/base/random.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/tessellation.hpp"
#include "tests/common/physics/scene_count.hpp"
#include "tests/common/physics/world_support.hpp"

namespace tandem::physics {

using ShapePointer = std::shared_ptr<const contact::ContactShape>;
using Part = TouchModel::Part;
using Parts = std::vector<Part>;

inline constexpr double kStiffness_n_per_m = 500;
inline constexpr double kSpeed_m_per_s = 0.04;
inline ShapePointer mesh_of(const geometry::TriangleMesh& mesh) {
  return contact::make_contact_mesh(geometry::repaired(mesh));
}

/// Returns a box. Boxes are cached by size, because building a mesh takes longer than running a scene.
inline ShapePointer box_of(const Vec3& size_m, bool is_mesh) {
  static std::map<std::tuple<double, double, double, bool>, ShapePointer> made;
  ShapePointer& shape = made[{size_m.x(), size_m.y(), size_m.z(), is_mesh}];
  if (!shape) shape = is_mesh ? mesh_of(geometry::tessellated_box(size_m)) : contact::make_contact_box(size_m);
  return shape;
}

inline ShapePointer rod_of(double radius_m, double length_m, bool is_mesh) {
  static std::map<std::tuple<double, double, bool>, ShapePointer> made;
  ShapePointer& shape = made[{radius_m, length_m, is_mesh}];
  if (!shape) {
    shape = is_mesh ? mesh_of(geometry::tessellated_cylinder(radius_m, length_m))
                    : contact::make_contact_cylinder(radius_m, length_m);
  }
  return shape;
}

inline Pose at_place(const Vec3& p, const Quat& q = Quat::Identity()) {
  return {p, q};
}

struct Tip {
  std::string name;
  Parts parts;
  double bottom_m = 0;  ///< distance of the lowest point below the origin of the tip
};

inline Tip tip_of(Random& random) {
  const double size_m = std::array{0.0005, 0.001, 0.002, 0.005, 0.01}[random.next_u32() % 5];
  const double r = size_m / 2, length_m = 0.01;
  Tip tip;
  switch (random.next_u32() % 6) {
    case 0:
      tip = {"ball", {{contact::make_contact_sphere(r), {}}}, r};
      break;
    case 1:
      tip = {"pin", {{rod_of(r, length_m, false), {}}}, length_m / 2};
      break;
    case 2:
      tip = {"capsule", {{contact::make_contact_capsule(r, length_m), {}}}, length_m / 2 + r};
      break;
    case 3:
      tip = {"box", {{box_of({size_m, size_m, length_m}, false), {}}}, length_m / 2};
      break;
    case 4:
      tip = {"mesh pin", {{rod_of(r, length_m, true), {}}}, length_m / 2};
      break;
    default:
      tip = {"mesh box", {{box_of({size_m, size_m, length_m}, true), {}}}, length_m / 2};
      break;
  }
  tip.name += " of " + std::to_string(size_m * 1e3) + " mm";
  return tip;
}

struct Draw {
  double press_n = 1;
  double friction = 0;
  Pose X_WU;  ///< pose of the surface in the world
  Vec3 from_U = Vec3::Zero(), to_U = Vec3::Zero();
  bool is_of_bodies = false;  ///< if true, each shape is a separate body
  int hold_steps = 0;         ///< number of steps for which the hand rests at the end
};

/// Moves the tip along the surface. Returns the forces on the hand in each step, in frame U.
inline std::vector<Vec3> drawn(const Parts& surface, const Tip& tip, const Draw& draw) {
  std::vector<BodyDescription> bodies;
  const auto add = [&](const Parts& parts) {
    BodyDescription body;
    body.touch = {parts, 0.1};
    body.traits.friction = draw.friction;
    body.X_WB = draw.X_WU;
    bodies.push_back(std::move(body));
  };
  if (draw.is_of_bodies) {
    for (const Part& part : surface) add({part});
  } else {
    add(surface);
  }
  ToolDescription tool;
  tool.touch = {tip.parts, 0.02};
  tool.mass = mass_of(kToolMass_kg, 0.015);
  tool.friction = draw.friction;
  const auto pose_at = [&](const Vec3& p_U) { return draw.X_WU * at_place(p_U + Vec3(0, 0, tip.bottom_m)); };
  tool.X_WT = pose_at(draw.from_U + Vec3(0, 0, 1e-4));
  WorldDescription description = world_of(std::move(bodies), {tool});
  description.coupling.parameters.stiffness_n_per_m = kStiffness_n_per_m;
  description.coupling.parameters.damping_n_s_per_m = 5;
  description.coupling.parameters.stiffness_n_m_per_rad = 0.5;
  description.coupling.parameters.damping_n_m_s_per_rad = 0.005;
  World world = client_world(description);
  world.activate_tool(0);
  const Vec3 press(0, 0, -draw.press_n / kStiffness_n_per_m);
  const int settle = 100;
  const Vec3 way = draw.to_U - draw.from_U;
  const int steps = static_cast<int>(way.norm() / kSpeed_m_per_s / kStep_s);
  std::vector<Vec3> forces;
  for (int i = 0; i < settle + steps + draw.hold_steps; ++i) {
    const double share = std::clamp(static_cast<double>(i - settle) / steps, 0.0, 1.0);
    const double pressing = std::min(1.0, 2.0 * i / settle);
    const Pose X = pose_at(draw.from_U + share * way + pressing * press);
    const Vec3 v = i < settle || i >= settle + steps ? Vec3(Vec3::Zero()) : Vec3(draw.X_WU.q * way / (steps * kStep_s));
    world.set_handle(0, {X, {v, Vec3::Zero()}});
    world.step();
    if (i >= settle) forces.push_back(draw.X_WU.q.conjugate() * world.tool(0).wrench_on_hand_W.f);
  }
  return forces;
}

}  // namespace tandem::physics
