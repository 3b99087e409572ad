// The part of a step that moves tools, held bodies and touched bodies together, by the implicit solver of
// common/contact. Private to the world.
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

/// Contact and coupling of one step.
///
/// Third law: the wrenches of a contact on an implicit and on an external thing are one number with two signs. The
/// external thing gets it as an outside force (RigidBody::apply_wrench()).
class TouchStage {
 public:
  struct Limits {
    std::size_t things = 80;
    std::size_t couplings = 16;
    std::size_t joints = 16;
    std::size_t pairs = 64;                                  ///< limit of pairs of shapes near each other
    std::uint32_t contact_points = contact::kContactBudget;  ///< limit for a pair
    double speed_m_per_s = 10;
  };
  explicit TouchStage(const Limits& limits);

  /// Moves the implicit things by `step_s` and applies the contact wrenches to the external ones. No allocation.
  TickFaults step(double step_s, std::span<TouchThing> things, std::span<TouchCoupling> couplings,
                  std::span<TouchJoint> joints) noexcept;

  /// Finds the contacts of the next step in idle time after a step, from the present poses and a likely reach. That
  /// reach is longer than that of a step, so there are more contacts that do not press. Contacts carry data from one
  /// search to the next; if the result is not used, they do so twice. Afterwards pressed_points_W() returns none.
  void look_ahead(double step_s, std::span<const TouchThing> things) noexcept;

  /// Contacts of an implicit thing in the last step.
  const TouchContact& contact(std::size_t thing) const { return felt_[thing]; }
  /// Contact of `thing` on `other` in the last step. Cost: linear in the near pairs.
  TouchBetween between(std::size_t thing, std::size_t other) const noexcept;
  /// Calls `use(thing_a, thing_b, result)` for each pair of shapes that pressed in the last step.
  template <class Use>
  void for_each_pressing(const Use& use) const {
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      if (results_[i].pressing > 0) use(patch_things_[i][0], patch_things_[i][1], results_[i]);
    }
  }
  /// Writes the points where `thing` pressed or was pressed, in W: as many as fit, spread over all. Returns their
  /// number.
  std::size_t pressed_points_W(std::size_t thing, std::span<Vec3> out) const noexcept;

 private:
  // Parts of a step, in order of execution.
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
  std::vector<Twist> gained_;       ///< velocity gained by each thing in this step from couplings, weight and fields
  std::vector<double> reach_m_;     ///< limit of each thing's motion in this step
  std::vector<int> body_of_thing_;  ///< index of the solver's body, or kStaticBody
  std::vector<std::size_t> thing_of_body_;
  std::vector<contact::SolverBody> bodies_;
  std::vector<contact::SolverCoupling> couplings_;  ///< couplings of hands, then joints, then drags
  std::vector<Wrench*> answers_;                    ///< destinations of the wrenches of hands and joints
  std::vector<Wrench> tool_wrenches_;
  std::vector<contact::SolverPatch> patches_;
  std::vector<NearPairs::Pair*> patch_pairs_;             ///< invalid after look_ahead(), which may reuse a pair
  std::vector<std::array<std::size_t, 2>> patch_things_;  ///< things of shapes A and B
  std::vector<Vec3> patch_normals_W_;                     ///< sum of normals, weighted by depth and area
  std::vector<contact::PatchResult> results_;
  contact::ContactSolver solver_;
};

}  // namespace tandem::physics
