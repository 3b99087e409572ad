// Tools without inertia, as two of the coupling laws define them. Private to the touch stage.
#pragma once

#include <span>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/physics/touch/touch_thing.hpp"

namespace tandem::physics {

/// Treats implicit things without inertia (TouchThing::dynamics) in the touch stage: massless things and things at
/// their handle. Each function is called once a step, in the order of declaration.
///
/// Model   kMassless: the thing moves to the equilibrium of its coupling, contacts and wrench_W, and has no velocity
///         afterwards. The solver gets a small mass instead, the regularisation, which changes the result negligibly. A
///         fluid around the thing is one more coupling.
///         kAtHandle: the thing is moved to the pose of its coupling; of several, to their mean. Each hand gets an
///         equal share of the load on the thing.
/// Source  our derivation
class InertialessThings {
 public:
  InertialessThings(std::size_t things, std::size_t tools, double speed_m_per_s);
  ~InertialessThings();

  /// Computes where couplings and joints take each such thing. A thing at the handle is slowed before it moves, so that
  /// its contacts are those of its final pose.
  TickFaults follow(double step_s, std::span<const TouchThing> things, std::span<const TouchCoupling> couplings,
                    std::span<const TouchJoint> joints) noexcept;
  /// Limit of this thing's motion in the step.
  double reach_m(double step_s, const TouchThing& thing, std::size_t index) const noexcept;
  /// Replaces the thing's inertia by the regularisation or by the prescribed motion.
  void describe(const TouchThing& thing, std::size_t index, contact::SolverBody& body) const noexcept;
  /// Adds the fluids around massless things as couplings.
  void add_drags(std::span<const TouchThing> things, std::span<const int> body_of_thing,
                 std::vector<contact::SolverCoupling>& couplings) noexcept;
  /// Computes the wrenches of hands and joints on things at the handle, which the solver does not include.
  void show_contacts(double step_s, std::span<const TouchThing> things, std::span<const TouchContact> felt,
                     std::span<TouchCoupling> couplings, std::span<TouchJoint> joints) const noexcept;

 private:
  struct Motion;

  void add_coupling(double step_s, const TouchThing& thing, const TouchCoupling& coupling, Motion& motion) noexcept;
  void add_joint(double step_s, const TouchThing& thing, const TouchJoint& joint, Motion& motion) noexcept;
  Wrench shown_W(double step_s, const TouchThing& thing, const Wrench& contact_W, const TouchCoupling& coupling,
                 std::span<const TouchJoint> joints) const noexcept;

  double speed_m_per_s_;
  std::vector<Motion> motions_;  ///< one for each thing
  std::vector<std::unique_ptr<haptics::CouplingLaw>> drag_laws_;
};

}  // namespace tandem::physics
