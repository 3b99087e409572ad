// Soft bodies beside a room's fast step: Bullet's position-based solver at its own rate, for tools at 1 kHz.
//
//   room step   k            k+1 … k+n−1            k+n                       (n room steps: one soft period)
//   advance()   poses ─┐     contact(): result      take the result of k,
//                      │     of k−n, linear         begin with poses of k+n ─┐
//   soft step          └──── computed from the poses of k ────┘              └── …
//
// A result is used exactly one soft period after its inputs. It is computed either at once inside advance() (lab,
// replays) or by a separate worker thread (live). Both give the same bits if the worker is in time. A late worker is
// not awaited: the last result remains in use, and kFaultSoftLate is reported at every step.
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

/// A rigid object that soft bodies can touch: a tool, a body, a table.
struct SoftRigid {
  physics::TouchModel model;  ///< in the frame of the object T
  double friction = 0.5;
  Pose X_WT = {};  ///< for static objects only
};

struct SoftWorldSettings {
  std::vector<SoftModel> bodies;
  std::vector<SoftRigid> tools;      ///< all movable objects, in the order of advance()
  std::vector<SoftRigid> obstacles;  ///< static objects
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  double room_rate_hz = 1000;
  double rate_hz = 60;  ///< rate of soft steps; the nearest whole number of room steps is used
  double speed_limit_m_per_s = 10;
  /// Whether to wait for a late worker. Used where the room runs faster than real time and must give the same bits.
  bool waits_for_worker = false;
  /// Called before each soft step on its thread, for tests and tracing; may be empty.
  std::function<void()> before_step;
};

/// Room steps in a soft step, at least 1.
int soft_period_steps(double room_rate_hz, double rate_hz);

/// Soft bodies in motion, as a deterministic simulation.
///
/// Invariant  the impulse of a soft step on a tool, W₀ times the length of the step, is opposite to the impulse that
///         the nodes got from it, for each correction
///
/// Thread  one at a time (the room's); with steps_aside a separate thread computes the steps
class SoftWorld final : public physics::SoftBodies {
 public:
  /// In      steps_aside  compute the steps in a separate thread, not within World::step(); both give the same bits
  explicit SoftWorld(SoftWorldSettings settings, bool steps_aside = false);
  ~SoftWorld() override;
  SoftWorld(const SoftWorld&) = delete;
  SoftWorld& operator=(const SoftWorld&) = delete;

  /// Advances by one room step, after the tools have their new poses X_WT, in the order of the settings' `tools`.
  ///
  /// Out     faults of the soft step whose result is taken over now: kFaultNotFinite (that body is reset),
  ///         kFaultSpeedLimited. kFaultSoftLate: the worker is not ready, and the last result remains in use
  /// Cost    with a worker: every n-th step copies poses and swaps buffers; no allocation, no lock. Without: a soft
  ///         step every n-th step
  TickFaults advance(std::span<const std::optional<Pose>> X_WT) noexcept override;

  /// Contact of a tool for soft_wrench(), valid until the next advance(). Empty for an absent tool.
  const SoftContact& contact(std::size_t tool) const noexcept override;

  /// Nodes of the last result and the surface over them, for viewers.
  std::size_t body_count() const;
  std::span<const Vec3> nodes_W(std::size_t body) const override;
  void set_nodes(std::size_t body, std::span<const Vec3> nodes_W) override;
  const SoftModel& model(std::size_t body) const;

  int period_steps() const;
  /// Number of late results since the start. Any thread.
  std::uint64_t late_count() const;
  /// Duration of the soft step whose result was taken last; only for benchmarks.
  double last_step_seconds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
