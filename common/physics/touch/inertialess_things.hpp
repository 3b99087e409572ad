// Tools without inertia, which two kinds of coupling laws require. Private to the touch stage.
#pragma once

#include <span>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/physics/touch/touch_thing.hpp"

namespace tandem::physics {

/// Handles the implicit objects without inertia in the touch stage: those whose TouchThing::dynamics is kMassless or
/// kAtHandle. In each step the public functions are called in the order of their declaration.
///
/// Model   kMassless: the object moves to the equilibrium of its coupling, its contacts and wrench_W, and has no
///         velocity at the end of the step. In the solver it has a small mass (the regularisation), whose effect on the
///         result is negligible. A fluid around the object is one more coupling.
///         kAtHandle: the object is moved to the pose of its coupling, or to the mean pose of several couplings. Each
///         hand receives an equal part of the load on the object.
/// Source  our derivation
class InertialessThings {
 public:
  InertialessThings(std::size_t things, std::size_t tools, double speed_m_per_s);
  ~InertialessThings();

  /// Computes how far the couplings and joints move each object without inertia. Objects of kind kAtHandle are already
  /// moved here, with limited speed. The contacts found later are therefore those of their final poses.
  TickFaults follow(double step_s, std::span<const TouchThing> things, std::span<const TouchCoupling> couplings,
                    std::span<const TouchJoint> joints) noexcept;
  /// Returns the upper limit of this object's motion in the step.
  double reach_m(double step_s, const TouchThing& thing, std::size_t index) const noexcept;
  /// Replaces the object's inertia in the solver by the regularisation or by the prescribed motion.
  void describe(const TouchThing& thing, std::size_t index, contact::SolverBody& body) const noexcept;
  /// Adds the fluids around massless objects as couplings.
  void add_drags(std::span<const TouchThing> things, std::span<const int> body_of_thing,
                 std::vector<contact::SolverCoupling>& couplings) noexcept;
  /// Computes the wrenches of hands and joints on objects of kind kAtHandle. The contact solver does not compute them.
  void show_contacts(double step_s, std::span<const TouchThing> things, std::span<const TouchContact> felt,
                     std::span<TouchCoupling> couplings, std::span<TouchJoint> joints) const noexcept;

 private:
  struct Motion;

  void add_coupling(double step_s, const TouchThing& thing, const TouchCoupling& coupling, Motion& motion) noexcept;
  void add_joint(double step_s, const TouchThing& thing, const TouchJoint& joint, Motion& motion) noexcept;
  Wrench shown_W(double step_s, const TouchThing& thing, const Wrench& contact_W, const TouchCoupling& coupling,
                 std::span<const TouchJoint> joints) const noexcept;

  double speed_m_per_s_;
  std::vector<Motion> motions_;  ///< one entry for each object
  std::vector<std::unique_ptr<haptics::CouplingLaw>> drag_laws_;
};

}  // namespace tandem::physics
