// The two laws of coupling for which a tool is no body with inertia. Private to the touch stage.
#pragma once

#include <span>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/physics/touch/touch_thing.hpp"

namespace tandem::physics {

/// What the touch stage does differently for implicit things without inertia (TouchThing::dynamics): those that are
/// massless and those that are where their handle is. Called in the order of the functions, once a step each.
///
/// Model   kMassless: moves to where its coupling, contacts and wrench_W balance, and has no velocity after. The solver
///         gets a mass instead, the regularisation, so small that the thing ends where it would without, and a fluid
///         round it as one more coupling.
///         kAtHandle: is taken to where its couplings say, of several to the middle; each hand is shown an equal share
///         of what bears on it.
/// Source  our derivation
class InertialessThings {
 public:
  InertialessThings(std::size_t things, std::size_t tools, double speed_m_per_s);
  ~InertialessThings();

  /// Where couplings and joints take each such thing. One at the handle is slowed before it moves, so that its contacts
  /// are those of where it gets.
  TickFaults follow(double step_s, std::span<const TouchThing> things, std::span<const TouchCoupling> couplings,
                    std::span<const TouchJoint> joints) noexcept;
  /// How far this one may get.
  double reach_m(double step_s, const TouchThing& thing, std::size_t index) const noexcept;
  /// Puts the regularisation, or the motion that is prescribed, into the place of its inertia.
  void describe(const TouchThing& thing, std::size_t index, contact::SolverBody& body) const noexcept;
  /// Fluids round the massless ones.
  void add_drags(std::span<const TouchThing> things, std::span<const int> body_of_thing,
                 std::vector<contact::SolverCoupling>& couplings) noexcept;
  /// What hands and joints get of things at the handle, which nothing was solved for.
  void show_contacts(double step_s, std::span<const TouchThing> things, std::span<const TouchContact> felt,
                     std::span<TouchCoupling> couplings, std::span<TouchJoint> joints) const noexcept;

 private:
  struct Motion;

  void add_coupling(double step_s, const TouchThing& thing, const TouchCoupling& coupling, Motion& motion) noexcept;
  void add_joint(double step_s, const TouchThing& thing, const TouchJoint& joint, Motion& motion) noexcept;
  Wrench shown_W(double step_s, const TouchThing& thing, const Wrench& contact_W, const TouchCoupling& coupling,
                 std::span<const TouchJoint> joints) const noexcept;

  double speed_m_per_s_;
  std::vector<Motion> motions_;  ///< of each thing
  std::vector<std::unique_ptr<haptics::CouplingLaw>> drag_laws_;
};

}  // namespace tandem::physics
