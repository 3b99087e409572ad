// The part of a step in which tools, what they hold and what they touch are stepped together (common/contact). Private
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

/// Contact and coupling of one step.
///
/// Third law: what a contact does to an implicit thing and to an external one is one number with two signs; the
/// external one gets it as an outside force (RigidBody::apply_wrench()).
class TouchStage {
 public:
  struct Limits {
    std::size_t things = 80;
    std::size_t couplings = 16;
    std::size_t joints = 16;
    std::size_t pairs = 64;                                  ///< pairs of shapes near each other at a time
    std::uint32_t contact_points = contact::kContactBudget;  ///< of a pair
    double speed_m_per_s = 10;
  };
  explicit TouchStage(const Limits& limits);

  /// Moves the implicit things by `step_s` and pushes the external ones. No allocation.
  TickFaults step(double step_s, std::span<TouchThing> things, std::span<TouchCoupling> couplings,
                  std::span<TouchJoint> joints) noexcept;

  /// After a step, when there is time: finds the contacts of the next one, with the things where they are now, in case they
  /// get no farther in it than is likely. As near as they may get then is farther than a step would look, so that there are more
  /// contacts that do not press; and where it was in vain, what contacts take over from one search to the next, they take over
  /// twice. pressed_points_W() has none after it.
  void look_ahead(double step_s, std::span<const TouchThing> things) noexcept;

  /// Of an implicit thing in the last step.
  const TouchContact& contact(std::size_t thing) const { return felt_[thing]; }
  /// Of `thing` on `other` in the last step. Cost: the pairs that were near.
  TouchBetween between(std::size_t thing, std::size_t other) const noexcept;
  /// Calls `use(thing_a, thing_b, result)` for each pair of shapes that pressed in the last step.
  template <class Use>
  void for_each_pressing(const Use& use) const {
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      if (results_[i].pressing > 0) use(patch_things_[i][0], patch_things_[i][1], results_[i]);
    }
  }
  /// Where `thing` pressed or was pressed, in W: as many as there are, or spread over them. How many were written.
  std::size_t pressed_points_W(std::size_t thing, std::span<Vec3> out) const noexcept;

 private:
  // In the order of the step.
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
  std::vector<Twist> gained_;       ///< by couplings, weight and fields in this step, of each thing
  std::vector<double> reach_m_;     ///< how far each thing may get in this step
  std::vector<int> body_of_thing_;  ///< index of the solver's body, or kStaticBody
  std::vector<std::size_t> thing_of_body_;
  std::vector<contact::SolverBody> bodies_;
  std::vector<contact::SolverCoupling> couplings_;  ///< of hands, then joints, then drags
  std::vector<Wrench*> answers_;                    ///< where those of hands and joints go
  std::vector<Wrench> tool_wrenches_;
  std::vector<contact::SolverPatch> patches_;
  std::vector<NearPairs::Pair*> patch_pairs_;             ///< not after look_ahead(): a pair may be another's then
  std::vector<std::array<std::size_t, 2>> patch_things_;  ///< A's and B's
  std::vector<Vec3> patch_normals_W_;                     ///< sum of normals, each times depth and area
  std::vector<contact::PatchResult> results_;
  contact::ContactSolver solver_;
};

}  // namespace tandem::physics
