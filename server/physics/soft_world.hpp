// Soft bodies of a room, stepped by Bullet's position-based solver at a lower rate than the room (1 kHz).
//
//   room step   k            k+1 … k+n−1            k+n                       (n room steps: one soft period)
//   advance()   poses ─┐     contact(): result      take the result of k,
//                      │     of k−n, linear         begin with poses of k+n ─┐
//   soft step          └──── computed from the poses of k ────┘              └── …
//
// A result is used exactly one soft period after the poses from which it was computed. Either advance() computes it
// (lab, replays), or a worker thread (live server). Both give bit-identical results while the worker is in time. The
// room does not wait for a late worker. It continues to use the last result, and reports kFaultSoftLate in every step
// until the new one is ready.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/physics/soft_bodies.hpp"
#include "common/physics/touch_model.hpp"
#include "server/physics/soft_model.hpp"

namespace tandem::server {

/// A rigid object that soft bodies can touch: a tool, a rigid body or a static object. T is the frame of the object.
struct SoftRigid {
  physics::TouchModel model;  ///< shape in the frame of the object T
  double friction = 0.5;
  Pose X_WT = {};  ///< pose of a static object; unused for other objects
};

struct SoftWorldSettings {
  std::vector<SoftModel> bodies;
  std::vector<SoftRigid> tools;      ///< tools, followed by movable bodies, in the order of the poses in advance()
  std::vector<SoftRigid> obstacles;  ///< static objects
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  double room_rate_hz = 1000;
  double rate_hz = 60;  ///< rate of soft steps, rounded such that a soft period is a whole number of room steps
  double speed_limit_m_per_s = 10;
  /// true: wait for a late worker. This is meant for rooms that run faster than real time and need bit-identical
  /// results.
  bool waits_for_worker = false;
  /// Called before each soft step on the thread that computes it; for tests and tracing. May be empty.
  std::function<void()> before_step;
};

/// Returns the number of room steps in a soft period, at least 1.
int soft_period_steps(double room_rate_hz, double rate_hz);

/// Soft bodies in motion, as a deterministic simulation.
///
/// Invariant  The impulses of a correction on tool and nodes are opposite. The impulse of a soft step on a tool equals
///            the wrench W₀ of the tool's contact times the length of the step
///
/// Thread  called from one thread at a time (the room's); with steps_aside a separate thread computes the steps
class SoftWorld final : public physics::SoftBodies {
 public:
  /// In      steps_aside  true: a worker thread computes the steps, not World::step(); the results are bit-identical
  explicit SoftWorld(SoftWorldSettings settings, bool steps_aside = false);
  ~SoftWorld() override;
  SoftWorld(const SoftWorld&) = delete;
  SoftWorld& operator=(const SoftWorld&) = delete;

  /// Advances by one room step. `X_WT` are the new poses of the tools, in the order of the settings' `tools`.
  ///
  /// Out     faults of the soft step whose result is used from now on: kFaultNotFinite (the body was reset) and
  ///         kFaultSpeedLimited. kFaultSoftLate: the worker is late, so the previous result remains in use
  /// Cost    with a worker, every n-th step copies poses and swaps buffers, without allocation or lock; without a
  ///         worker, every n-th step includes a soft step
  TickFaults advance(std::span<const std::optional<Pose>> X_WT) noexcept override;

  /// Returns the contact of a tool, for soft_wrench(). Valid until the next advance(). Empty for an absent tool.
  const SoftContact& contact(std::size_t tool) const noexcept override;

  /// Nodes of the last result, and the model with their surface, for viewers.
  std::size_t body_count() const;
  std::span<const Vec3> nodes_W(std::size_t body) const override;
  void set_nodes(std::size_t body, std::span<const Vec3> nodes_W) override;
  const SoftModel& model(std::size_t body) const;

  int period_steps() const;
  /// Number of late results since the start. Thread: any.
  std::uint64_t late_count() const;
  /// Returns the computation time of the soft step whose result is in use [s], for benchmarks.
  double last_step_seconds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
