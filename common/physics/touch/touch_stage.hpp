// Moves tools, held bodies and touched bodies together in a step, with the implicit solver of common/contact. Private
// to the world.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/contact/contact_solver.hpp"
#include "common/physics/touch/inertialess_things.hpp"
#include "common/physics/touch/near_pairs.hpp"
#include "common/physics/touch/touch_thing.hpp"

namespace tandem::physics {

/// Computes contact and coupling of one step.
///
/// Terms (TouchThing::Role): this stage moves implicit objects; another component moves external objects.
/// Third law: a contact between an implicit and an external object has one wrench. The external object receives it with
/// the opposite sign, as an external force (RigidBody::apply_wrench()).
class TouchStage {
 public:
  struct Limits {
    std::size_t things = 80;
    std::size_t couplings = 16;
    std::size_t joints = 16;
    std::size_t pairs = 64;                                  ///< limit on the pairs of close shapes
    std::uint32_t contact_points = contact::kContactBudget;  ///< limit for each pair
    double speed_m_per_s = 10;
  };
  explicit TouchStage(const Limits& limits);

  /// Moves the implicit objects by `step_s`, and applies the contact wrenches to the external objects. Allocates
  /// nothing.
  TickFaults step(double step_s, std::span<TouchThing> things, std::span<TouchCoupling> couplings,
                  std::span<TouchJoint> joints) noexcept;

  /// Searches the contacts of the next step in idle time, from the present poses and a predicted reach. Two side
  /// effects:
  /// * The predicted reach is longer than the reach of a step, so more contacts without a force are found.
  /// * If the step does not use the result, it searches again. The contacts' friction state is then transferred once
  ///   more than usual, from the discarded search to the new one.
  /// After this call, pressed_points_W() returns no points.
  void look_ahead(double step_s, std::span<const TouchThing> things) noexcept;

  /// Contacts of an implicit object (one that this stage moves) in the last step.
  const TouchContact& contact(std::size_t thing) const { return felt_[thing]; }
  /// Returns the contact of `thing` with `other` in the last step. Cost: linear in the number of close pairs.
  TouchBetween between(std::size_t thing, std::size_t other) const noexcept;
  /// Calls `use(thing_a, thing_b, result)` for each pair of shapes with a contact force in the last step.
  template <class Use>
  void for_each_pressing(const Use& use) const {
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      if (results_[i].pressing > 0) use(patch_things_[i][0], patch_things_[i][1], results_[i]);
    }
  }
  /// Writes the positions in W of contact points of `thing` that have a force, and returns their number. If `out` is
  /// too small for all points, evenly spaced entries of their list are written.
  std::size_t pressed_points_W(std::size_t thing, std::span<Vec3> out) const noexcept;

 private:
  // The following functions are the parts of a step, in the order of execution.
  void predict_reach(double step_s, std::span<const TouchThing> things, std::span<const TouchCoupling> couplings,
                     std::span<const TouchJoint> joints) noexcept;
  void add_bodies(std::span<const TouchThing> things) noexcept;
  void add_body(std::span<const TouchThing> things, std::size_t thing) noexcept;
  TickFaults find_contacts(std::span<const TouchThing> things) noexcept;
  void add_patch(std::span<const TouchThing> things, NearPairs::Pair& near) noexcept;
  void add_couplings(std::span<const TouchThing> things, std::span<TouchCoupling> couplings,
                     std::span<TouchJoint> joints) noexcept;
  void add_coupling(const contact::SolverCoupling& coupling, Wrench& answer) noexcept;
  template <class Use>
  void for_each_pressed_W(std::size_t thing, const Use& use) const noexcept;
  TickFaults solve(double step_s) noexcept;
  void feel() noexcept;
  void find_reached(std::span<const TouchThing> things) noexcept;
  TickFaults write_back(double step_s, std::span<TouchThing> things) noexcept;

  Limits limits_;
  InertialessThings inertialess_;
  NearPairs pairs_;
  std::vector<TouchContact> felt_;
  std::vector<Twist> gained_;       ///< velocity that each object gains in this step from couplings, weight, fields
  std::vector<double> reach_m_;     ///< upper limit of each object's motion in this step
  std::vector<int> body_of_thing_;  ///< index of the object's body in the solver, or kStaticBody
  std::vector<std::size_t> thing_of_body_;
  std::vector<contact::SolverBody> bodies_;
  std::vector<contact::SolverCoupling> couplings_;  ///< couplings of hands, then joints, then fluids
  std::vector<Wrench*> answers_;                    ///< destinations of the resulting wrenches of hands and joints
  std::vector<Wrench> tool_wrenches_;
  std::vector<contact::SolverPatch> patches_;
  std::vector<NearPairs::Pair*> patch_pairs_;             ///< invalid after look_ahead(), which may reuse a pair
  std::vector<std::array<std::size_t, 2>> patch_things_;  ///< the objects of shapes A and B
  std::vector<Vec3> patch_normals_W_;                     ///< sum of the contact normals, weighted by depth and area
  std::vector<contact::PatchResult> results_;
  contact::ContactSolver solver_;
};

}  // namespace tandem::physics
