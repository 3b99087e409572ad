// Measures the energy that a hand can extract from a coupling. The hand follows a random path, or is moved by a driver.
//
// Terms:
//   W       work that the hand has done so far [J]; a negative W is energy that the hand has extracted
//   driver  worst-case motion of the hand, which chooses its direction so as to gain energy
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "lab/studies/rendering/hand_rig.hpp"

namespace tandem::lab {

/// Returns a path of a hand that starts at rest and passes through random waypoints. Their distances and rotations are
/// those of a human hand. The path leads into the plane, along the plane, and away from it.
inline devices::HandPath random_path(std::uint64_t seed, double length_s) {
  Random random(seed, 1);
  std::vector<devices::WayPoint> points{{Duration(0), Pose{}, 0, ""}};
  double at_s = 0.1;
  while (at_s < length_s) {
    at_s += random.uniform(0.15, 0.5);
    devices::WayPoint point;
    point.at = from_seconds(at_s);
    for (int i = 0; i < 3; ++i) point.X_DH.p[i] = random.uniform(-0.02, 0.02);
    point.X_DH.q = quaternion_of(Vec3(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)));
    points.push_back(point);
  }
  return devices::HandPath(std::move(points));
}

/// Returns the smallest W during a run of a simulated hand on a random path.
inline double least_work_j(const HandRigSettings& settings, std::uint64_t seed, double length_s) {
  HandRig rig(settings, random_path(seed, length_s));
  double least = 0;
  for (double at_s = 0; at_s < length_s; at_s += 1 / settings.rate_hz) least = std::min(least, rig.tick().hand_work_j);
  return least;
}

/// Direction in which a driver moves the handle: into the plane and out, along the plane while pressing, or in
/// rotation.
enum class DriverWay : std::uint8_t { kDown, kAlong, kTurning };
inline constexpr std::array kDriverWays{DriverWay::kDown, DriverWay::kAlong, DriverWay::kTurning};

inline std::string name_of(DriverWay way) {
  constexpr std::array kNames{"down", "along", "turning"};
  return kNames.at(static_cast<std::size_t>(way));
}

/// Largest motions of a driver, in metres or, for a rotation, in radians.
struct DriverLimits {
  double speed_per_s = 0.1;
  double acceleration_per_s2 = 10;
  double decision_s = 0.05;  ///< minimum time between changes of direction
  double rashness = 0.2;     ///< fraction of the decisions that the driver makes at random instead of by the force
  double reach = 0.02;       ///< largest distance from the start
};
/// Limits of a human hand: at most one new direction in 50 ms, 10 m/s² in translation, 200 rad/s² in rotation.
inline DriverLimits human_limits(DriverWay way) {
  return way == DriverWay::kTurning ? DriverLimits{2, 200, 0.05, 0.2, 0.4} : DriverLimits{};
}
/// Limits of a driver that may choose a new direction in every tick. It is faster than any hand, but within the
/// assumptions of the passivity controller.
inline DriverLimits tick_limits(DriverWay way) {
  return way == DriverWay::kTurning ? DriverLimits{1, 5000, 0.001, 0.2, 0.1}
                                    : DriverLimits{0.05, 100, 0.001, 0.2, 0.005};
}

/// Moves the handle along one coordinate such that it gains energy. It moves with the force while the force is above
/// its recent mean, and against the force while it is below. Thus it receives more work from the large forces than it
/// does against the small ones. Some decisions are random.
class Driver {
 public:
  Driver(const DriverLimits& limits, std::uint64_t seed, double period_s)
      : limits_(limits), random_(seed, 2), period_s_(period_s) {}

  double next_step(double force) {
    mean_ += std::min(1.0, period_s_ / (4 * limits_.decision_s)) * (force - mean_);
    since_s_ += period_s_;
    if (since_s_ + period_s_ / 2 >= limits_.decision_s) decide(force);
    const double most = limits_.acceleration_per_s2 * period_s_;
    speed_ += std::clamp(direction_ * limits_.speed_per_s - speed_, -most, most);
    at_ += speed_ * period_s_;
    return speed_ * period_s_;
  }

 private:
  void decide(double force) {
    since_s_ = 0;
    const double along = force >= 0 ? 1 : -1;
    direction_ = std::abs(force) > std::abs(mean_) ? along : -along;
    if (random_.uniform() < limits_.rashness) direction_ = random_.uniform() < 0.5 ? -1 : 1;
    if (std::abs(at_) > limits_.reach) direction_ = at_ > 0 ? -1 : 1;
  }

  DriverLimits limits_;
  Random random_;
  double period_s_;
  double mean_ = 0;
  double since_s_ = 0;
  double direction_ = -1;
  double speed_ = 0;
  double at_ = 0;
};

/// Presses the handle 3 mm beyond the plane within 0.2 s, then rests for 0.2 s.
inline HandRigTick pressed_down(HandRig& rig, const HandRigSettings& settings) {
  const double depth_m = 0.003 - settings.plane_z_m.value_or(0);
  const int steps = static_cast<int>(0.2 * settings.rate_hz);
  for (int i = 0; i < steps; ++i) rig.tick_driven(-depth_m / steps * Vec3::UnitZ());
  HandRigTick tick;
  for (int i = 0; i < steps; ++i) tick = rig.tick_driven(Vec3::Zero());
  return tick;
}

/// Smallest values of W during a run of a driver.
struct DrivenWork {
  double from_rest_j = 0;  ///< W counted from the first tick, at which the hand is at rest
  double reported_j = 0;   ///< same as from_rest_j, but computed from the positions that the device reports
  /// W counted from the time at which the driver begins. Before it begins to move along the plane, the handle is
  /// pressed into the plane, and the work of this press does not count. The energy that the press stores cannot be
  /// extracted by motion along the plane.
  double from_start_j = 0;
};

inline DrivenWork least_driven_work(const HandRigSettings& settings, DriverWay way, const DriverLimits& limits,
                                    std::uint64_t seed, double length_s) {
  HandRig rig(settings, devices::named_hand_path("rest"));
  Driver driver(limits, seed, 1 / settings.rate_hz);
  HandRigTick tick = way == DriverWay::kAlong ? pressed_down(rig, settings) : rig.tick_driven(Vec3::Zero());
  const double start_j = tick.hand_work_j;
  DrivenWork least;
  for (double at_s = 0; at_s < length_s; at_s += 1 / settings.rate_hz) {
    const Wrench& on_hand = tick.on_hand_W;
    switch (way) {
      case DriverWay::kDown:
        tick = rig.tick_driven(driver.next_step(on_hand.f.z()) * Vec3::UnitZ());
        break;
      case DriverWay::kAlong:
        tick = rig.tick_driven(driver.next_step(on_hand.f.x()) * Vec3::UnitX());
        break;
      case DriverWay::kTurning:
        tick = rig.tick_driven(Vec3::Zero(), driver.next_step(on_hand.t.x()) * Vec3::UnitX());
        break;
    }
    least.from_rest_j = std::min(least.from_rest_j, tick.hand_work_j);
    least.reported_j = std::min(least.reported_j, tick.reported_work_j);
    least.from_start_j = std::min(least.from_start_j, tick.hand_work_j - start_j);
  }
  return least;
}

/// Returns the smallest W of a hand that gains energy from a law that switches between two force curves. Four times the
/// hand moves slowly inwards, against the smaller force of one curve, and then outwards, with the larger force of the
/// other curve.
inline double least_stroke_work_j(const HandRigSettings& settings) {
  HandRig rig(settings, devices::named_hand_path("rest"));
  const double step_m = 0.05 / settings.rate_hz;
  const int steps = static_cast<int>(0.015 / step_m);
  double least = 0;
  for (int i = 0; i < 8 * steps; ++i) {
    const bool is_going_in = i / steps % 2 == 0;
    least = std::min(least, rig.tick_driven((is_going_in ? -step_m : step_m) * Vec3::UnitZ()).hand_work_j);
  }
  return least;
}

}  // namespace tandem::lab
