// Inputs and outputs of the touch stage in each step. A "thing" is a rigid object: a body or a tool. Private to the
// world.
#pragma once

#include <cstdint>
#include <optional>

#include "common/haptics/coupling/laws.hpp"
#include "common/physics/effects/effect.hpp"
#include "common/physics/joints/joint.hpp"
#include "common/physics/rigid_body.hpp"
#include "common/physics/tool_hand.hpp"
#include "common/physics/touch_model.hpp"

namespace tandem::physics {

/// Fluid around a massless object, at the object's origin. A massless object has no velocity at the start of a step
/// from which its drag could be computed, so the drag is part of the solution.
struct TouchDrag {
  Viscosity fluid{0, 0};
  Twist V_W;  ///< velocity of the fluid
  double force_limit_n = 0;
  double torque_limit_n_m = 0;

  bool is_acting() const { return fluid.damping_n_s_per_m > 0 || fluid.damping_n_m_s_per_rad > 0; }
  /// Adds another fluid at the same position. Dampings and limits are summed; velocities are averaged with the dampings
  /// as weights.
  void add(const TouchDrag& more) noexcept;
};

/// One rigid object (body or tool) of the world in the current step.
struct TouchThing {
  /// Component that moves the object:
  /// * kAbsent: none; the object is not in the world.
  /// * kImplicit: the touch stage.
  /// * kExternal: FreeBodies. If the object touches an implicit object, the touch stage includes its inertia in the
  ///   solution and applies the contact wrench to it.
  /// * kStatic: none; the object does not move.
  enum class Role : std::uint8_t { kAbsent, kImplicit, kExternal, kStatic };

  RigidBody* rigid = nullptr;
  const TouchModel* model = nullptr;
  Role role = Role::kAbsent;
  /// True: bodies that this object touches become implicit. It is true for tools, and for bodies that are held or kept
  /// in the touch stage.
  bool makes_implicit = false;
  std::uint32_t hands = 0;  ///< bit i: this object is tool i, or tool i holds it
  haptics::ToolDynamics dynamics = haptics::ToolDynamics::kWithMass;  ///< used only for implicit objects
  Wrench wrench_W = {};                                               ///< weight and fields, about the centre of mass
  std::optional<std::size_t> passes_through = {};                     ///< object with which contact is ignored
  TouchDrag drag = {};                                                ///< used only for a massless object

  bool has_inertia() const { return dynamics == haptics::ToolDynamics::kWithMass; }
  bool is_massless() const { return dynamics == haptics::ToolDynamics::kMassless; }
  bool is_at_handle() const { return dynamics == haptics::ToolDynamics::kAtHandle; }
};

/// Coupling of one tool. `wrench_W` is an output of the stage: the wrench of the hand on the tool, about the tool's
/// origin, at the end of the step.
struct TouchCoupling {
  std::size_t tool = 0;
  std::size_t thing = 0;  ///< the tool, or the body that it holds
  const ToolHand* hand = nullptr;
  Pose X_WT;
  Wrench wrench_W;
};

/// A joint, such as an anchor. `wrench_W` is an output of the stage: the wrench on the object, about the origin of the
/// joint's frame, at the end of the step.
struct TouchJoint {
  std::size_t thing = 0;
  const JointLaw* law = nullptr;
  RigidState target;
  Pose X_WT;             ///< joint frame, fixed to the object
  Wrench wrench_W = {};  ///< zero for an external object without contact, because its joint is not part of the solution
  bool is_solved = false;  ///< true: wrench_W is a result; false: the joint was not part of the solution

  contact::SolverCoupling coupling(int body) const { return {body, law, target.X, target.V, X_WT}; }
};

/// Contacts of an implicit object in the last step.
struct TouchContact {
  std::uint32_t pressing = 0;  ///< number of contact points with a force
  double deepest_m = 0;
  bool is_reached = false;  ///< true: the object makes others implicit, or is linked to such an object by contacts
  /// Bit i: tool i acts on the object: it is the object, holds it, or touches it directly or through other objects.
  std::uint32_t hands = 0;
  Wrench wrench_W;  ///< total contact wrench on the object, about the origin of W
  Twist V_WC;       ///< velocity of its centre in the step, also for a massless object
};

/// Contact between two objects in the last step.
struct TouchBetween {
  double normal_force_n = 0;     ///< sum of the magnitudes of the normal forces
  Vec3 normal_W = Vec3::Zero();  ///< mean normal, a unit vector out of the second object; zero: no contact
};

/// Limits the motion of an object to the distance within which contacts were searched. Returns true if the motion was
/// scaled down. A shortened motion is safe, because it covers only the first part of the solved motion.
bool limit_motion(Twist& V_WC, double radius_m, double speed_m_per_s) noexcept;

}  // namespace tandem::physics
