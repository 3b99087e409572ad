// The shared world: bodies, tools, contacts and fields, stepped at a fixed rate. Bullet lives behind this
// header and nowhere else.
#pragma once

#include <memory>

#include "common/ids.hpp"
#include "proto/state.hpp"
#include "proto/tick_faults.hpp"
#include "server/scene_file.hpp"

namespace tandem {

/// kBusy: the room's own, see Room.
enum class GrabResult { kGrabbed, kUnknownBody, kNotGraspable, kOutOfReach, kAlreadyHolding, kBusy };

/// One user's tool after a step.
struct ToolState {
  RigidState tool;
  Wrench wrench_on_hand_W;  ///< the coupling's, about the handle
  BodyId held;
  double energy_into_world_j = 0;  ///< Σ of positive work of the coupling on the world
  double energy_from_world_j = 0;  ///< Σ of work drawn from the world, ≥ 0
};

/// What a tool touched in a step.
struct TouchSummary {
  std::uint32_t contacts = 0;  ///< points that pressed
  double deepest_m = 0;
  double force_n = 0;       ///< of all contacts together
  double soft_force_n = 0;  ///< of soft bodies
};

/// A scene in motion.
///
/// Each tool is a rigid body without weight, pulled to its user's handle by the scene's coupling law; or, as the law
/// has it, one without mass, that is where coupling and contact balance, or one that is where the handle is
/// (ToolDynamics). While a tool holds a body the two move as one: the coupling acts on the body, at the tool's place on
/// it, and the tool neither collides nor adds mass. Several tools may hold the same body. A tool that is inside the
/// body that it releases passes through it until they have come apart.
///
/// Tools, held bodies, and what these touch are stepped by the implicit solver of common/contact (touch_stage.hpp),
/// with coupling, contact and friction in one solution: no tool is too light and no coupling or surface too stiff.
/// Bullet steps the bodies that nobody touches. Soft bodies step at a rate of their own (soft_world.hpp).
///
/// The same calls in the same order give the same bits on the same machine.
///
/// Thread  one at a time (the room's)
class World {
 public:
  /// How soft bodies are stepped: within step(), or by a thread of their own. Both give the same bits.
  enum class SoftStepping { kInline, kWorker };

  explicit World(std::shared_ptr<const LoadedScene> scene, SoftStepping soft_stepping = SoftStepping::kInline);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Brings a tool to life at its start pose, and the body that it holds from the start into its hand: moved to the
  /// body's start pose, unless another tool holds it; then the tool appears at its place on the body.
  void activate_tool(std::size_t tool);
  /// Takes a tool out of the world; what it held is let go.
  void deactivate_tool(std::size_t tool);
  /// The newest known handle of a tool's user; couples until clear_handle().
  void set_handle(std::size_t tool, const RigidState& handle);
  /// No input, until the next set_handle(): a free tool floats, damped; a held body is held softly where it is.
  void clear_handle(std::size_t tool);

  /// `body` invalid: the nearest graspable body in reach.
  GrabResult grab(std::size_t tool, BodyId body);
  void release(std::size_t tool);

  /// Replaces the coupling's coefficients, by CouplingRamp from the next step on; what the law chooses itself for a
  /// tool stays (coupling_in_force()). Ignored when one is negative or not finite.
  void set_coupling(const CouplingParameters& parameters);

  /// Advances by 1 / step_rate_hz seconds. No throw; faults are bits.
  TickFaults step() noexcept;

  ToolState tool(std::size_t tool) const;
  /// What the tool, or the body that it holds, touched in the last step.
  TouchSummary touch(std::size_t tool) const;
  std::size_t body_count() const;
  /// At rest at the origin for an id that the scene does not have.
  RigidState body(BodyId id) const;
  /// Of the whole scene; 0 without molecules.
  double field_energy_kj_per_mol() const;
  /// Kinetic + gravitational energy of the moving bodies and tools [J], for tests and reports.
  double mechanical_energy_j() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
