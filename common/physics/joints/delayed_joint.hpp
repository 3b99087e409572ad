// How stiffly the copies of a body that several users touch may be joined over a network.
#pragma once

#include <algorithm>

#include "common/base/time.hpp"
#include "common/physics/joints/joint.hpp"

namespace tandem::physics {

/// A damper, and how much of it over the one-way delay is the spring beside it.
struct DelayedSpring {
  double damping_n_s_per_m = 0;
  double stiffness_share = 0;
};

struct DelayedJointSettings {
  /// In the direction in which the tool presses: what keeps a thing between two hands.
  DelayedSpring along{.damping_n_s_per_m = 32, .stiffness_share = 0.95};
  /// In all others: what is carried, and dragged along by 2 · share · damping.
  DelayedSpring across{.damping_n_s_per_m = 12, .stiffness_share = 0.6};
  double most_stiffness_n_per_m = 1200;  ///< however short the delay
  double lever_m =
      0.06;  ///< the rotational joint is that across at this distance: for a hand of 4e-4 kg·m² what 32 N·s/m
             ///< is for one of 0.3 kg
};

/// The joint between a body at the server and its copy at a client, each pulled to where the other was.
///
/// Model   k = share · b / T, T half of `loop`. A spring over a delay gives back k T of negative damping for each end's
///         motion; b takes it, and the hands take the rest. What moves evenly is dragged by k · v · 2T: 2 · share · b,
///         whatever the delay, so across the pressing direction, where friction has to bear it, the joint is softer.
/// Source  the damper between copies: Sankaranarayanan, Hannaford, "Experimental comparison of internet haptic
///         collaboration with time-delay compensation techniques", ICRA 2008, for the scheme. The figures are ours: one
///         degree of freedom, two hands of 0.3 kg and 200 N/m on a body of 0.3 kg, loops of 25 to 300 ms. Calm (≤ 2.7
///         mm/s) for b 20 to 40 N·s/m and shares of 0.4 to 1.0; at b 60 they ring, at 1.3 too.
/// In      loop  from an input to its effect coming back, waiting included; shorter than 2 ms counts as that
///         slowest_loop  of all who touch the body: with it all are as soft across, and bear equal shares of its weight
///         pressing_W  unit, or zero: the same in all directions, as across
inline Joint joint_for(Duration loop, Duration slowest_loop, const Vec3& pressing_W,
                       const DelayedJointSettings& settings = {}) noexcept {
  const auto stiffness = [&](const DelayedSpring& spring, Duration of) {
    const double one_way_s = std::max(1e-3, to_seconds(of) / 2);
    return std::min(settings.most_stiffness_n_per_m, spring.stiffness_share * spring.damping_n_s_per_m / one_way_s);
  };
  const double lever_square = settings.lever_m * settings.lever_m;
  Joint joint;
  joint.stiffness_n_per_m = stiffness(settings.across, std::max(loop, slowest_loop));
  joint.damping_n_s_per_m = settings.across.damping_n_s_per_m;
  joint.stiffness_n_m_per_rad = joint.stiffness_n_per_m * lever_square;
  joint.damping_n_m_s_per_rad = joint.damping_n_s_per_m * lever_square;
  joint.axis_W = pressing_W;
  joint.axis_stiffness_n_per_m = stiffness(settings.along, loop);
  joint.axis_damping_n_s_per_m = settings.along.damping_n_s_per_m;
  return joint;
}

/// How much of a pull is the joint: goes to 1 while a body is shared and back to 0 after, evenly in time, so that the
/// change is felt as no step.
class JointShare {
 public:
  static constexpr double kRise_s = 0.1;
  static constexpr double kFall_s = 0.2;

  double step(double period_s, bool is_shared) noexcept {
    const double change = is_shared ? period_s / kRise_s : -period_s / kFall_s;
    ramp_ = std::clamp(ramp_ + change, 0.0, 1.0);
    return now();
  }
  /// Eased at both ends.
  double now() const noexcept { return ramp_ * ramp_ * (3 - 2 * ramp_); }
  /// At once, for a thing that the joint's other end has led so far: its target has to begin where the thing is.
  void fill() noexcept { ramp_ = 1; }
  void reset() noexcept { ramp_ = 0; }

 private:
  double ramp_ = 0;
};

/// How much of a shared body's weight the copy of a user who holds it bears; moved evenly.
class WeightShare {
 public:
  static constexpr double kTurn_s = 0.1;  ///< for all of it

  double step(double period_s, double wanted) noexcept {
    now_ += std::clamp(wanted - now_, -period_s / kTurn_s, period_s / kTurn_s);
    return now_;
  }
  double now() const noexcept { return now_; }
  void reset() noexcept { now_ = 0; }

 private:
  double now_ = 0;
};

}  // namespace tandem::physics
