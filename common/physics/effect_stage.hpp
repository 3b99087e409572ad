// The part of a step in which the scene's effects (common/physics/effects) act on the tools. Private to the world.
#pragma once

#include <span>
#include <vector>

#include "common/physics/effects/effect.hpp"
#include "common/physics/touch/touch_stage.hpp"

namespace tandem::physics {

/// Effects as wrenches from outside, on tools and, oppositely, on the bodies that the effects belong to.
///
/// One after the other, each seeing the velocities that those before it leave behind: dampers that overlap then slow
/// a tool as one damper would, and never turn it back. Contact is that of the last step. A body's own effects
/// do not act on a tool that holds it: what it does to itself is nothing. A body that several tools hold gets an equal
/// share of what acts at each.
///
/// A massless tool gives way by its coupling, k h² instead of a mass; fluids are given to TouchStage to solve with
/// (TouchDrag), for a wrench from the last step's velocity would be unstable from b = k h/2 on.
///
/// Third law: both wrenches have one line of action, through the tool's origin. What such a fluid does to the body that
/// it belongs to comes a step later, when it is known.
class EffectStage {
 public:
  EffectStage(std::span<const EffectSettings> effects, std::size_t things, std::size_t tools);

  bool is_empty() const { return effects_.empty(); }
  /// A new user, or none: what the effects remember of the tool is of somebody else.
  void forget(std::size_t tool) noexcept;
  /// Adds to `wrench_W` of implicit and external things; external ones are pushed where they are stepped as well. No
  /// allocation.
  /// In      things  bodies first, in the order of the scene
  ///         tools  that a hand moves
  void apply(double time_s, double step_s, std::span<TouchThing> things, std::span<const TouchCoupling> tools,
             const TouchStage& touch) noexcept;

 private:
  /// One effect and one tool in this step.
  struct Meeting;

  void apply_one(double time_s, double step_s, std::size_t index, std::span<TouchThing> things,
                 const TouchCoupling& tool, const TouchStage& touch) noexcept;
  void flow_round(const Meeting& meeting, const EffectInput& input, std::span<TouchThing> things,
                  TouchDrag& flow) noexcept;
  void push(double step_s, TouchThing& thing, std::size_t index, const Wrench& wrench_W, const Vec3& p_W) noexcept;

  std::vector<Effect> effects_;
  std::vector<EffectMemory> memories_;  ///< of tool t and effect e: t · effects + e
  std::vector<TouchDrag> flows_;        ///< alike: the fluid round a massless tool in the last step
  std::vector<int> hands_;              ///< that pull at each thing
  std::vector<Twist> velocities_;       ///< of the things' centres, as far as effects have changed them
};

}  // namespace tandem::physics
