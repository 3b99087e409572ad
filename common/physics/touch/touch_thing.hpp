// What the touch stage is given of the world in each step, and what it answers. Private to the world.
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

/// Fluid round a massless thing, at the thing's origin: what slows it is solved for together with all else, because the
/// thing brings no velocity into the step.
struct TouchDrag {
  Viscosity fluid{0, 0};
  Twist V_W;  ///< of the fluid
  double force_limit_n = 0;
  double torque_limit_n_m = 0;

  bool is_there() const { return fluid.damping_n_s_per_m > 0 || fluid.damping_n_m_s_per_rad > 0; }
  /// Another fluid in the same place: dampings and limits add up, velocities mix by damping.
  void add(const TouchDrag& more) noexcept;
};

/// One rigid thing of the world, as it is in this step.
struct TouchThing {
  /// kAbsent: not there. kImplicit: moved by this stage alone. kExternal: one of the FreeBodies; in the step in which
  /// an implicit thing first touches it, the stage accounts for its inertia and hands the contacts' wrench on. kStatic:
  /// does not move.
  enum class Role : std::uint8_t { kAbsent, kImplicit, kExternal, kStatic };

  RigidBody* rigid = nullptr;
  const TouchModel* model = nullptr;
  Role role = Role::kAbsent;
  bool makes_implicit = false;  ///< a tool, or held by one, or else surely implicit: what it touches becomes so too
  std::uint32_t hands = 0;      ///< bit i: it is tool i, or held by it
  haptics::ToolDynamics dynamics = haptics::ToolDynamics::kWithMass;  ///< of implicit ones: InertialessThings
  Wrench wrench_W = {};                                               ///< weight and fields, about the centre of mass
  std::optional<std::size_t> passes_through = {};                     ///< a thing that it does not touch
  TouchDrag drag = {};                                                ///< of a massless one only

  bool has_inertia() const { return dynamics == haptics::ToolDynamics::kWithMass; }
  bool is_massless() const { return dynamics == haptics::ToolDynamics::kMassless; }
  bool is_at_handle() const { return dynamics == haptics::ToolDynamics::kAtHandle; }
};

/// One tool's coupling; `wrench_W` is the answer: what the hand does to the tool, about the tool's origin at the end of
/// the step.
struct TouchCoupling {
  std::size_t tool = 0;
  std::size_t thing = 0;  ///< the tool itself, or the body that it holds
  const ToolHand* hand = nullptr;
  Pose X_WT;
  Wrench wrench_W;
};

/// A delayed joint or an anchor; `wrench_W` is the answer: what it did to the thing, about the origin of the frame that
/// it acts on, at the end of the step.
struct TouchJoint {
  std::size_t thing = 0;
  const JointLaw* law = nullptr;
  RigidState target;
  Pose X_WT;               ///< of the frame, fixed to the thing
  Wrench wrench_W = {};    ///< zero, too, for an external thing that nothing touched
  bool is_solved = false;  ///< false: of such a thing, and of no effect

  contact::SolverCoupling coupling(int body) const { return {body, law, target.X, target.V, X_WT}; }
};

/// What an implicit thing felt in the last step.
struct TouchContact {
  std::uint32_t pressing = 0;  ///< contact points with a force
  double deepest_m = 0;
  bool is_reached = false;  ///< it makes others implicit, or is pressed by one that does, directly or through others
  std::uint32_t hands = 0;  ///< of those that reach it, or that it is
  Wrench wrench_W;          ///< of all contacts on it, about the origin of W
  Twist V_WC;               ///< with which its centre went through the step; a massless thing has no other velocity
};

/// How two things pressed on each other in the last step.
struct TouchBetween {
  double normal_force_n = 0;     ///< sum of the magnitudes
  Vec3 normal_W = Vec3::Zero();  ///< mean, unit, out of the second thing; zero: no contact
};

/// A thing must not get farther than was looked ahead: what it would meet there was not looked for. Moving less than
/// was solved for is safe, for it is less of the same way. True when it had to be slowed.
bool limit_motion(Twist& V_WC, double radius_m, double speed_m_per_s) noexcept;

}  // namespace tandem::physics
