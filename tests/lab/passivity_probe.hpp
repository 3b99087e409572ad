// What a hand can take out of a coupling: random hands, and drivers that choose their direction to gain.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "common/random.hpp"
#include "lab/rendering/hand_rig.hpp"

namespace tandem::lab {

/// Rest for a moment, then way points a human hand reaches, turned a little: into the plane, along it, off it.
inline HandPath random_path(std::uint64_t seed, double length_s) {
  Random random(seed, 1);
  std::vector<WayPoint> points{{Duration(0), Pose{}, 0, ""}};
  double at_s = 0.1;
  while (at_s < length_s) {
    at_s += random.uniform(0.15, 0.5);
    WayPoint point;
    point.at = from_seconds(at_s);
    for (int i = 0; i < 3; ++i) point.X_DH.p[i] = random.uniform(-0.02, 0.02);
    point.X_DH.q = quaternion_of(Vec3(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)));
    points.push_back(point);
  }
  return HandPath(std::move(points));
}

/// Least W over a run of a simulated hand.
inline double least_work_j(const HandRigSettings& settings, std::uint64_t seed, double length_s) {
  HandRig rig(settings, random_path(seed, length_s));
  double least = 0;
  for (double at_s = 0; at_s < length_s; at_s += 1 / settings.rate_hz) least = std::min(least, rig.tick().hand_work_j);
  return least;
}

struct DriverLimits {
  double speed_m_per_s = 0.1;
  double acceleration_m_per_s2 = 10;
  double decision_s = 0.05;  ///< it keeps to a direction at least so long
  double rashness = 0.2;     ///< share of decisions by chance
  double reach_m = 0.02;     ///< from where it began
};
/// As fast as a hand can: directions of 50 ms, 10 m/s².
inline constexpr DriverLimits kHumanLimits{};
/// Every tick another direction if that pays: more than any hand, and within what the guard assumes of one.
inline constexpr DriverLimits kTickLimits{0.05, 100, 0.001, 0.2, 0.005};

/// Moves the handle along z. It goes with the force when that is above its recent mean (a good time to be paid) and
/// against it when it is below (a cheap time to invest), and now and then as chance has it.
class Driver {
 public:
  Driver(const DriverLimits& limits, std::uint64_t seed, double period_s)
      : limits_(limits), random_(seed, 2), period_s_(period_s) {}

  Vec3 next_step(double force_n) {
    mean_n_ += std::min(1.0, period_s_ / (4 * limits_.decision_s)) * (force_n - mean_n_);
    since_s_ += period_s_;
    if (since_s_ + period_s_ / 2 >= limits_.decision_s) decide(force_n);
    const double most = limits_.acceleration_m_per_s2 * period_s_;
    speed_ += std::clamp(direction_ * limits_.speed_m_per_s - speed_, -most, most);
    at_m_ += speed_ * period_s_;
    return speed_ * period_s_ * Vec3::UnitZ();
  }

 private:
  void decide(double force_n) {
    since_s_ = 0;
    const double along = force_n >= 0 ? 1 : -1;
    direction_ = std::abs(force_n) > std::abs(mean_n_) ? along : -along;
    if (random_.uniform() < limits_.rashness) direction_ = random_.uniform() < 0.5 ? -1 : 1;
    if (std::abs(at_m_) > limits_.reach_m) direction_ = at_m_ > 0 ? -1 : 1;
  }

  DriverLimits limits_;
  Random random_;
  double period_s_;
  double mean_n_ = 0;
  double since_s_ = 0;
  double direction_ = -1;
  double speed_ = 0;
  double at_m_ = 0;
};

/// Least W over a run of the driver.
inline double least_driven_work_j(const HandRigSettings& settings, const DriverLimits& limits, std::uint64_t seed,
                                  double length_s) {
  HandRig rig(settings, named_hand_path("rest"));
  Driver driver(limits, seed, 1 / settings.rate_hz);
  HandRigTick tick = rig.tick_driven(Vec3::Zero());
  double least = 0;
  for (double at_s = 0; at_s < length_s; at_s += 1 / settings.rate_hz) {
    tick = rig.tick_driven(driver.next_step(tick.on_hand_W.f.z()));
    least = std::min(least, tick.hand_work_j);
  }
  return least;
}

/// Least W of a driver that knows laws that switch: slowly in on the soft curve, out on the stiff one, four times.
inline double least_stroke_work_j(const HandRigSettings& settings) {
  HandRig rig(settings, named_hand_path("rest"));
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
