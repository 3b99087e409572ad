// A simulated scene of bodies, tools, contacts and fields, stepped at a fixed rate. The server has one world for each
// room. A client has one as its local model.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "common/base/ids.hpp"
#include "common/base/tick_faults.hpp"
#include "common/base/time.hpp"
#include "common/base/touch_exchange.hpp"
#include "common/physics/free_bodies.hpp"
#include "common/physics/joints/joint.hpp"
#include "common/physics/soft_bodies.hpp"
#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// Result of a grab. Only the server's room returns kBusy.
enum class GrabResult { kGrabbed, kUnknownBody, kNotGraspable, kOutOfReach, kAlreadyHolding, kBusy };

/// State of one user's tool after a step.
struct ToolState {
  RigidState tool;
  Wrench wrench_on_hand_W;  ///< wrench of the coupling on the hand, about the handle
  Wrench pull_on_tool_W;    ///< reaction to wrench_on_hand_W, about the tool's origin
  BodyId held;
  bool has_handle = false;         ///< whether the tool is coupled to a handle
  RigidState handle;               ///< state of the handle; valid if has_handle
  double energy_into_world_j = 0;  ///< sum of the positive work of the coupling on the world
  double energy_from_world_j = 0;  ///< sum of the work drawn from the world, ≥ 0
};

/// Duration of a change of gravity. Even if gravity changes by 9.81 m/s², the weight of a held body of 1 kg then
/// changes by only 0.03 N/ms.
inline constexpr double kGravityRamp_s = 0.3;

/// Contacts of a tool in the last step.
struct TouchSummary {
  std::uint32_t contacts = 0;  ///< number of contact points with a force
  double deepest_m = 0;
  double force_n = 0;       ///< magnitude of the total contact force
  double soft_force_n = 0;  ///< magnitude of the force of soft bodies
};

/// A simulated scene.
///
/// Tools: each tool is a weightless rigid body, coupled to its user's handle by the scene's coupling law. Some laws
/// (ToolDynamics) require a massless tool, which is in equilibrium between coupling and contact, or a tool placed at
/// the handle.
/// Holding: a tool and the body that it holds move as one. The coupling then acts on the body at the tool's grip; the
/// tool does not collide and adds no mass. Several tools may hold the same body. If a tool is inside a body when it
/// releases this body, it passes through the body until both have separated. A body that a tool holds from the start of
/// the scene remains at rest until any tool takes or touches it.
///
/// Solvers: tools, held bodies and the bodies that they touch are stepped by the implicit solver of common/contact
/// (touch/touch_stage.hpp). It solves coupling, anchors, contact and friction together, so light tools and stiff
/// couplings or surfaces do not make the step unstable. FreeBodies steps the bodies that no tool touches. Soft bodies
/// have a step rate of their own.
///
/// Deterministic: on the same machine, the same calls in the same order give bit-identical results. Tools and bodies
/// are identified by their index in the description. A tool index must be valid; a body id may be invalid.
///
/// Thread  room or haptic, one at a time
class World {
 public:
  /// In      soft_bodies  null if there are no soft bodies
  World(std::shared_ptr<const WorldDescription> description, std::unique_ptr<FreeBodies> free_bodies,
        std::unique_ptr<SoftBodies> soft_bodies);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  /// Replaces this world by another one. References to this object remain valid.
  World& operator=(World&& other) noexcept;

  /// Activates a tool at its start pose. If the description names a body that the tool holds from the start, this body
  /// is moved to its start pose and attached. If another tool already holds the body, the body is not moved; the new
  /// tool is placed at its grip on the body.
  /// In      takes_its_body  false: the tool starts without a body, and no body is moved
  void activate_tool(std::size_t tool, bool takes_its_body = true);
  /// Deactivates a tool and releases the body that it holds.
  void deactivate_tool(std::size_t tool);
  /// Sets the newest state of the user's handle. The tool is coupled to it until clear_handle().
  void set_handle(std::size_t tool, const RigidState& handle);
  /// Ends the coupling to the handle until the next set_handle(). A tool that holds nothing then continues to move and
  /// is damped. If it holds a body, its coupling pulls the body to its present pose.
  void clear_handle(std::size_t tool);

  /// Grabs a body. If `body` is invalid, grabs the nearest graspable body within reach.
  GrabResult grab(std::size_t tool, BodyId body);
  /// Attaches a body to a tool with the grip `X_BT`, the tool's pose relative to the body. Unlike grab(), it does not
  /// check the distance from tool to body, so that a client can apply the server's state. A body held before is
  /// released. Ignored for an unknown or static body and for an inactive tool.
  void hold(std::size_t tool, BodyId body, const Pose& X_BT);
  /// Moves the grip on the held body towards `X_BT`, by at most `most_m` and 10 rad per metre of `most_m`. With
  /// repeated calls, a client's grip approaches the server's grip without a jerk.
  void move_grip(std::size_t tool, const Pose& X_BT, double most_m);
  void release(std::size_t tool);

  /// Sets a new law and new coefficients as the target of the coupling; LawFade fades to it from the next step on.
  /// Coefficients that the law determines for a tool are not changed (coupling_in_force()). Ignored if a coefficient is
  /// negative or not finite, or if the law cannot replace the scene's law (are_exchangeable()).
  void set_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& parameters);
  /// Sets new coefficients for the present law.
  void set_coupling(const haptics::CouplingParameters& parameters);
  /// Sets upper limits that the user's device requires for the coupling of this tool (rendered_coupling()). They apply
  /// until the tool is deactivated. Ignored if a limit is negative or NaN.
  void set_coupling_bounds(std::size_t tool, const haptics::CouplingParameters& bounds);
  /// Coefficients that currently apply to the tool.
  const haptics::CouplingParameters& coupling(std::size_t tool) const;

  /// Sets the brake of the tool's coupling: a damping of the tool's velocity in the world, and of its rotation with the
  /// lever arm kBrakeLever_m. A brake has no force at rest, so a held body is not dropped. A tool at its handle
  /// (ToolDynamics::kAtHandle) is not braked. Ignored if negative or not finite.
  void brake(std::size_t tool, double n_s_per_m);

  /// Excludes a body from motion, contact and molecular forces until restore_body(), set_body() or hold(). Tools that
  /// hold the body release it.
  void remove_body(BodyId body);
  /// Ends the exclusion of a body. The body continues from its present state.
  void restore_body(BodyId body);
  bool is_absent(BodyId body) const;
  /// Sets the gravity of rigid bodies. For bodies in the touch stage, it changes at a constant rate within
  /// kGravityRamp_s, so that the weight of a held body does not jump. For free bodies it changes at once. Soft bodies
  /// keep the gravity of the description. Ignored if not finite.
  void set_gravity(const Vec3& m_per_s2);
  /// Sets the gravity of all rigid bodies without a ramp, for a world that continues another world. Ignored if not
  /// finite.
  void jump_gravity(const Vec3& m_per_s2);
  /// Returns the present gravity of bodies in the touch stage [m/s²].
  Vec3 gravity() const;
  /// Sets the state of a body, or of a tool that holds nothing, for example to the server's state. Ignored if the state
  /// is not finite.
  void set_body(BodyId body, const RigidState& state);
  void set_tool(std::size_t tool, const RigidState& state);
  /// Applies a small correction between steps; no energy sum includes it. The displacement `by_W` rotates about the
  /// centre of mass; `dv` is added to the velocity of the centre. Ignored for a tool that holds a body, because the
  /// tool moves with the body.
  void shift_body(BodyId body, const Pose& by_W, const Twist& dv);
  void shift_tool(std::size_t tool, const Pose& by_W, const Twist& dv);
  /// Keeps the body in the touch stage for at least `seconds` from now. When this time has passed, the body leaves the
  /// touch stage if it is neither held nor touched.
  void keep_implicit(BodyId body, double seconds);
  /// Sets the contact of the tool, or of its held body, with soft bodies; valid until the next call. Meant for worlds
  /// that receive this contact from the server instead of simulating soft bodies.
  void set_soft_contact(std::size_t tool, const SoftContact& contact);

  /// Advances by step_s: calls answer(), then finish(). Does not throw; faults are returned as bits.
  TickFaults step() noexcept;
  /// First part of a step: moves implicit bodies and tools, and computes everything that the users feel. External
  /// bodies (see the README) are moved only by finish(). Until then, body() extrapolates them with their previous
  /// velocity, without the contacts of this step. Call finish() before any other non-const function.
  TickFaults answer() noexcept;
  /// Second part of a step. Does nothing if answer() was not called before.
  TickFaults finish() noexcept;
  /// Searches contacts and molecular forces of the next step in idle time, from the present poses. The result is
  /// discarded, and the step repeats the search, if a body or tool changes its pose in between or moves farther than
  /// predicted. After this call, contact_points_W() returns no points.
  void look_ahead() noexcept;
  /// Runs several steps without look_ahead() and returns the processor time of the fastest one. The minimum hardly
  /// depends on other load of the machine.
  Duration quickest_step() noexcept;

  /// Bodies that the last step returned to their start poses, at rest. Reasons are a request, a state that is not
  /// finite, or a position beyond limits.bounds_m while no tool holds the body.
  std::span<const BodyId> returned_bodies() const noexcept;
  /// Requests that the next step returns each moving body to its start pose, at rest. Tools release the bodies that
  /// they hold. Exception: a tool keeps a body that it holds from the start of the scene.
  void return_all() noexcept;
  /// Nodes of a soft body after the last step, for display.
  std::span<const Vec3> soft_nodes_W(std::size_t soft_body) const;
  /// Sets the nodes of a soft body, at rest. Allowed only before the first step, and only in a world with soft bodies.
  /// Fails   throws std::invalid_argument for a wrong number of nodes
  void set_soft_nodes(std::size_t soft_body, std::span<const Vec3> nodes_W);
  ToolState tool(std::size_t tool) const;
  /// Contacts of the tool, or of its held body, in the last step.
  TouchSummary touch(std::size_t tool) const;
  /// Linearised contact of the tool, or of its held body, with soft bodies; a trust radius of 0 means no contact.
  const SoftContact& soft_contact(std::size_t tool) const noexcept;
  /// Writes contact points of the tool, or of its held body, in the last step, and returns their number. If `out` is
  /// too small for all points, evenly spaced entries of their list are written.
  std::size_t contact_points_W(std::size_t tool, std::span<Vec3> out) const noexcept;
  /// Mean contact normal of a free tool with a body in the last step: a unit vector out of the body, or zero without
  /// contact.
  Vec3 pressing_normal_W(std::size_t tool, BodyId body) const;
  /// Returns the tools that act on a body, as a set: bit i is set if tool i holds the body, or was in contact with it
  /// in the last step, directly or through other moving bodies. Returns 0 for a static body.
  std::uint32_t hands_on(BodyId body) const;
  /// State of a body. For an unknown id, returns a state at rest at the origin.
  RigidState body(BodyId id) const;
  /// Molecular energy of the whole scene at the start of the last step; 0 if there are no molecules.
  double field_energy_kj_per_mol() const;
  double field_energy_j() const;  ///< displayed part of the molecular energy, in joules of the world
  /// Energy stored in the world [J], the sum of three parts:
  /// * kinetic and gravitational energy of moving bodies and tools
  /// * energy of anchors and of present couplings
  /// * displayed molecular energy, computed without the limit of the molecular force
  /// The energy of contacts is not included.
  /// In      without_hands  bit i: the coupling of tool i is excluded
  double stored_energy_j(std::uint32_t without_hands = 0) const;
  /// Energy stored in a tool's coupling [J].
  double coupling_energy_j(std::size_t tool) const;
  /// Energy of a tool [J]: the energy stored in its coupling, plus the kinetic energy of a tool that has mass and holds
  /// nothing.
  double energy_of_tool_j(std::size_t tool) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::physics
