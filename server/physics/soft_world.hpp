// Soft bodies beside a room's fast step: Bullet's position-based solver at its own rate, for tools at 1 kHz.
//
//   room step   k            k+1 … k+n−1            k+n                       (n room steps: one soft period)
//   advance()   poses ─┐     contact(): result      take the result of k,
//                      │     of k−n, linear         begin with poses of k+n ─┐
//   soft step          └──── computed from the poses of k ────┘              └── …
//
// A result is used exactly one soft period after its inputs, whether it is computed at once inside advance() (kInline:
// the lab, replays) or by a thread of its own (kWorker: live). So both give the same bits, as long as the worker is in
// time. One that is late is not waited for: the last result serves on, and kFaultSoftLate says so at every step.
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

/// A rigid thing that soft bodies meet: a tool, a body, a table.
struct SoftRigid {
  physics::TouchModel model;  ///< in the frame of the thing T
  double friction = 0.5;
  Pose X_WT = {};  ///< of one that never moves
};

struct SoftWorldSettings {
  std::vector<SoftModel> bodies;
  std::vector<SoftRigid> tools;      ///< everything movable, in the order of advance()
  std::vector<SoftRigid> obstacles;  ///< what never moves
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  double room_rate_hz = 1000;
  double rate_hz = 60;  ///< of soft steps; the nearest whole number of room steps is taken
  double speed_limit_m_per_s = 10;
  /// Wait for a worker that is late: for who steps the room faster than time, and wants the same bits as without.
  bool waits_for_worker = false;
  /// Called before each soft step on the thread that does it, for tests and tracing; may be empty.
  std::function<void()> before_step;
};

/// Room steps in a soft step, at least 1.
int soft_period_steps(double room_rate_hz, double rate_hz);

/// Soft bodies in motion.
///
/// Same calls, same bits. Third law: the impulse of a soft step on a tool, W₀ times the soft step's length, is
/// the opposite of what the soft bodies' nodes got from it, push by push.
///
/// Thread  one at a time (the room's); with steps_aside a thread of its own does the steps
class SoftWorld final : public physics::SoftBodies {
 public:
  /// In      steps_aside  by a thread of their own, not within World::step(); both give the same bits
  explicit SoftWorld(SoftWorldSettings settings, bool steps_aside = false);
  ~SoftWorld() override;
  SoftWorld(const SoftWorld&) = delete;
  SoftWorld& operator=(const SoftWorld&) = delete;

  /// Once a room step, after the tools have their new poses X_WT, in the order of the settings' `tools`.
  ///
  /// Out     faults of the soft step whose result is taken now: kFaultNotFinite (that body starts anew),
  ///         kFaultSpeedLimited; kFaultSoftLate: the worker is not ready, the last result serves on
  /// Cost    kWorker: one step in n copies poses and swaps buffers; no allocation, no lock. kInline: a soft step in n
  TickFaults advance(std::span<const std::optional<Pose>> X_WT) noexcept override;

  /// For soft_wrench(): of a tool, until the next advance(). Empty for one that is not there.
  const SoftContact& contact(std::size_t tool) const noexcept override;

  /// For viewers, of the last result: nodes, and the surface over them.
  std::size_t body_count() const;
  std::span<const Vec3> nodes_W(std::size_t body) const override;
  void set_nodes(std::size_t body, std::span<const Vec3> nodes_W) override;
  const SoftModel& model(std::size_t body) const;

  int period_steps() const;
  /// Results that came late, since the start. Any thread.
  std::uint64_t late_count() const;
  /// Of the soft step whose result was taken last: for benchmarks, never for decisions.
  double last_step_seconds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
