// A scene in motion: bodies, tools, contacts and fields, stepped at a fixed rate. The server has one a room, a client
// one of what its user touches.
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

/// kBusy: the room's own, see Room.
enum class GrabResult { kGrabbed, kUnknownBody, kNotGraspable, kOutOfReach, kAlreadyHolding, kBusy };

/// One user's tool after a step.
struct ToolState {
  RigidState tool;
  Wrench wrench_on_hand_W;  ///< of the coupling, about the handle
  Wrench pull_on_tool_W;    ///< the same from the tool's end, about its origin
  BodyId held;
  bool has_handle = false;         ///< one pulls it …
  RigidState handle;               ///< … this
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
/// body that it releases passes through it until they have come apart. A body that a tool of the scene holds from the
/// start waits there for it, at rest, until some tool takes or touches it.
///
/// Tools, held bodies, and what these touch are stepped by the implicit solver of common/contact
/// (touch/touch_stage.hpp), with coupling, anchors, contact and friction in one solution: no tool is too light
/// and no coupling or surface too stiff. FreeBodies steps the bodies that nobody touches. Soft bodies step at a rate of
/// their own.
///
/// The same calls in the same order give the same bits on the same machine. Tools and bodies are named by their place
/// in the description; a tool that is not there must not be asked for, a body may.
///
/// Thread  one at a time (the room's, or the client's haptic loop)
class World {
 public:
  /// In      soft  null without soft bodies
  World(std::shared_ptr<const WorldDescription> description, std::unique_ptr<FreeBodies> free_bodies,
        std::unique_ptr<SoftBodies> soft_bodies);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  /// Becomes another one. References to this stay good.
  World& operator=(World&& other) noexcept;

  /// Brings a tool to life at its start pose, and the body that it holds from the start into its hand: moved to the
  /// body's start pose, unless another tool holds it; then the tool appears at its place on the body.
  /// In      takes_its_body  false: the tool comes empty, and no body is moved
  void activate_tool(std::size_t tool, bool takes_its_body = true);
  /// Takes a tool out of the world; what it held is let go.
  void deactivate_tool(std::size_t tool);
  /// The newest known handle of a tool's user; couples until clear_handle().
  void set_handle(std::size_t tool, const RigidState& handle);
  /// No input, until the next set_handle(): a free tool floats, damped; a held body is held softly where it is.
  void clear_handle(std::size_t tool);

  /// `body` invalid: the nearest graspable body in reach.
  GrabResult grab(std::size_t tool, BodyId body);
  /// Takes the body at a place of the tool's on it, wherever the tool is: somebody else has decided. What the tool held
  /// is let go. Ignored for a body that is not there or static, or a tool that is not active.
  void hold(std::size_t tool, BodyId body, const Pose& X_BT);
  /// Moves the tool's place on the body that it holds towards `X_BT`, by `most_m` at most, and as many of 50 mrad as
  /// that has of 5 mm: where it took hold and where somebody else says it did are one place again, without a jerk.
  void move_grip(std::size_t tool, const Pose& X_BT, double most_m);
  void release(std::size_t tool);

  /// Replaces the coupling's law and coefficients, by LawFade from the next step on; what the law chooses itself for a
  /// tool stays (coupling_in_force()). Ignored when a coefficient is negative or not finite, or the law cannot take the
  /// place of the scene's (are_exchangeable()).
  void set_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& parameters);
  /// The coefficients alone.
  void set_coupling(const haptics::CouplingParameters& parameters);
  /// What the device of the tool's user bears: the coupling of this tool is held to it (rendered_coupling()). Until the
  /// tool is taken out of the world. Ignored when one is negative or NaN.
  void set_coupling_bounds(std::size_t tool, const haptics::CouplingParameters& bounds);
  /// In force for the tool now.
  const haptics::CouplingParameters& coupling(std::size_t tool) const;

  /// From now on the tool's coupling also brakes what it moves, by this times its velocity in the world; turning by that at kBrakeLever_m. At rest a brake does nothing: what is held stays held.
  /// A tool that is where its handle is (ToolDynamics::kAtHandle) is not braked. Ignored below 0 or not finite.
  void brake(std::size_t tool, double n_s_per_m);

  /// Nothing meets the body, neither contact nor field, until set_body() or hold() says where it is.
  void remove_body(BodyId body);
  /// Puts a body, or a tool that holds nothing, where somebody else says it is. Not finite: ignored.
  void set_body(BodyId body, const RigidState& state);
  void set_tool(std::size_t tool, const RigidState& state);
  /// Small corrections between steps, which no account of work sees: displaced by `by_W`, whose turn is about the
  /// centre of mass (of a tool about that of the tool), and `dv` added to the centre's velocity. A tool that holds a
  /// body is moved with the body alone.
  void shift_body(BodyId body, const Pose& by_W, const Twist& dv);
  void shift_tool(std::size_t tool, const Pose& by_W, const Twist& dv);
  /// The touch stage steps the body for so long at least; 0: no longer than it is held or touched.
  void keep_implicit(BodyId body, double seconds);
  /// What soft bodies do to the tool, or to what it holds, where this world has no soft bodies itself; until the next.
  void set_soft_contact(std::size_t tool, const SoftContact& contact);

  /// Advances by step_s: answer(), then finish(). No throw; faults are bits.
  TickFaults step() noexcept;
  /// What of a step hands feel, as soon as it is known: implicit bodies and tools are where the step leaves them. Until
  /// finish(), body() takes an external one (see the README) there by its velocity of before, so that what meets it in this step
  /// does not show yet: call finish() before anything that is not const.
  TickFaults answer() noexcept;
  /// The rest of it. Does nothing without an answer() before.
  TickFaults finish() noexcept;
  /// After a step, when there is time: finds contacts and field of the next one with all things where they are now. Where they
  /// are not there any more then, or get farther than is likely, the step finds them itself. contact_points_W() has none after it.
  void look_ahead() noexcept;
  /// Some steps without look_ahead(), and the processor's time that the quickest of them took: what else the machine does
  /// counts little.
  Duration quickest_step() noexcept;

  /// Bodies that the last step put back to their starts, at rest: not finite any more, or beyond limits.bounds_m with
  /// nobody's hand on them.
  std::span<const BodyId> put_back() const noexcept;
  /// In the next step each body that moves comes back to its start, at rest, and whoever holds it lets go; but not of what
  /// his tool holds from the start.
  void put_all_back() noexcept;
  /// Of a soft body, as the last step left them; for viewers.
  std::span<const Vec3> soft_nodes_W(std::size_t soft_body) const;
  /// Before the first step: the nodes of a soft body that the world has are here, at rest.
  /// Fails   std::invalid_argument: another number of nodes
  void set_soft_nodes(std::size_t soft_body, std::span<const Vec3> nodes_W);
  ToolState tool(std::size_t tool) const;
  /// What the tool, or the body that it holds, touched in the last step.
  TouchSummary touch(std::size_t tool) const;
  /// What soft bodies do to the tool, or to what it holds, linearised; a trust radius of 0: nothing.
  const SoftContact& soft_contact(std::size_t tool) const noexcept;
  /// Where the tool, or what it holds, touched in the last step: as many as fit, spread over them. How many were written.
  std::size_t contact_points_W(std::size_t tool, std::span<Vec3> out) const noexcept;
  /// Mean normal of the contacts of a free tool with a body in the last step, unit, out of the body; zero: none.
  Vec3 pressing_normal_W(std::size_t tool, BodyId body) const;
  /// Bit i: tool i holds the body, or pressed on it in the last step, itself or through other things that move. 0 of a
  /// static body.
  std::uint32_t hands_on(BodyId body) const;
  /// At rest at the origin for an id that the scene does not have.
  RigidState body(BodyId id) const;
  /// Of the whole scene, as the last step began; 0 without molecules.
  double field_energy_kj_per_mol() const;
  double field_energy_j() const;  ///< the same in the world's joules
  /// All that the world holds [J]: kinetic and gravitational energy of the moving bodies and tools, what anchors,
  /// couplings and joints store, each as in force, and the molecular field, unbounded. Contacts hold more, which is not
  /// counted.
  /// In      without_hands  bit i: the coupling of tool i is left out
  double stored_energy_j(std::uint32_t without_hands = 0) const;
  /// What a tool's coupling stores [J].
  double coupling_energy_j(std::size_t tool) const;
  /// Of a tool: kinetic where it has mass and holds nothing, and what its coupling stores [J].
  double energy_of_tool_j(std::size_t tool) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::physics
