// Haptic rendering for one user without a server: a simulated hand touches a fixed box and a moving sphere with a
// point. To add haptic rendering to another program, start from this sample. Scenes that several users share are the
// subject of sample 01. For them, the client's stage "god-object" uses the method of this sample.
//
//   02_god_object            prints a table; the force is 0 while nothing is touched
#include <array>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>

#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/proxy/god_object.hpp"
#include "devices/device_writer.hpp"
#include "devices/sim/sim_device.hpp"

namespace {

using namespace std::chrono_literals;
using tandem::Pose;
using tandem::Vec3;

Pose at(const Vec3& p) {
  return {p, tandem::Quat::Identity()};
}

/// Intended path of the simulated hand: down into the box, along its top, then up to a point on the sphere's path.
tandem::devices::HandPath hand_path() {
  return tandem::devices::HandPath({{0ms, at({0, 0, 0.03}), 0, "approach"},
                                    {600ms, at({0, 0, -0.01}), 0, "press"},
                                    {1200ms, at({0.015, 0, -0.01}), 0, "slide"},
                                    {1800ms, at({0.015, 0, 0.03}), 0, "wait"},
                                    {3000ms, at({0.015, 0, 0.03}), 0, ""}});
}

/// Returns the state of the sphere. It moves at 0.1 m/s past the last point of the hand's path.
tandem::RigidState sphere_at(double t_s) {
  const Vec3 v_W(-0.1, 0, 0);
  return {at(Vec3(0.27, 0.004, 0.03) + v_W * t_s), {v_W, Vec3::Zero()}};
}

int run() {
  // Any device of devices/ may be used; SimDevice includes a simulated hand. The writer clamps forces to the device's
  // limits.
  tandem::devices::SimDevice device(tandem::devices::SimDevice::default_spec(), tandem::devices::HandParameters{},
                                    hand_path(), /*seed=*/1);
  tandem::devices::DeviceWriter writer(device);

  // An obstacle is a primitive with an exact distance function, or a ProxyMesh of triangles. In this sample, the
  // device's frame is the world frame. Other programs convert between the two frames by a workspace mapping
  // (common/base/workspace.hpp).
  tandem::haptics::ProxyObstacle box;
  box.primitive = tandem::contact::box_field(Vec3(0.08, 0.08, 0.02));
  box.static_friction = 0.5;
  box.dynamic_friction = 0.3;
  tandem::haptics::ProxyObstacle sphere;
  sphere.primitive = tandem::contact::sphere_field(0.02);
  sphere.X_WB = sphere_at(0).X;
  tandem::haptics::GodObject proxy({.radius_m = 2e-3, .is_shaded = true}, {box, sphere}, Vec3(0, 0, 0.03));

  // Spring between hand and proxy. Its force is limited to force_limit_n. Other laws are listed in coupling/laws.hpp.
  const auto spring = tandem::haptics::make_coupling_law(
      "spring-damper", {.stiffness_n_per_m = 600, .damping_n_s_per_m = 2, .force_limit_n = 6});

  std::puts("   time   hand z  proxy x  proxy z    depth    force");
  std::puts("      s       mm       mm       mm       mm        N");
  for (int tick = 0; tick < 3000; ++tick) {
    // A program with a real device must wait here for the next millisecond. common/realtime/realtime.hpp provides
    // real-time priority, and timers with absolute deadlines that measure lateness. This sample does not wait.
    const tandem::LocalTime now(1ms * tick);
    const tandem::devices::DeviceSample sample = device.read(now);
    if (!sample.is_valid) {
      writer.write_zero(now);
      continue;
    }
    const std::array motions{tandem::RigidState{}, sphere_at(tandem::to_seconds(now.time_since_epoch()))};
    const tandem::haptics::ProxyState& state = proxy.update(sample.X_DH.p, motions);
    const Vec3 force_on_hand_W = tandem::haptics::proxy_force_on_hand_W(state, *spring, sample.V_DH.v);
    writer.write(now, {force_on_hand_W, Vec3::Zero()});
    if (tick % 100 == 0) {
      std::printf("%7.1f %8.2f %8.2f %8.2f %8.2f %8.2f\n", tandem::to_seconds(now.time_since_epoch()),
                  1e3 * sample.X_DH.p.z(), 1e3 * state.p_W.x(), 1e3 * state.p_W.z(),
                  1e3 * (state.goal_W - state.p_W).norm(), force_on_hand_W.norm());
    }
  }
  // After the loop, the device must not keep displaying the last force.
  writer.write_zero(tandem::LocalTime(3s));
  return 0;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "02_god_object: %s\n", error.what());
    return 2;
  }
}
