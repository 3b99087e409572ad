// Application of the scene's effects (common/physics/effects) to the tools in a step. Private to the world.
#pragma once

#include <span>
#include <vector>

#include "common/physics/effects/effect.hpp"
#include "common/physics/touch/touch_stage.hpp"

namespace tandem::physics {

/// Applies effects as outside wrenches on tools, and the opposite on the bodies that own the effects.
///
/// Effects are applied one after the other, each with the velocities that the earlier ones leave. Overlapping dampers
/// therefore slow a tool as one damper would, and never turn it back. Contacts are those of the last step. A body's own
/// effects do not act on a tool that holds it. A body that several tools hold gets an equal share of the effect at
/// each.
///
/// A massless tool yields by its coupling: k h² takes the place of a mass. Fluids around it are solved for by
/// TouchStage (TouchDrag), because a wrench from the last step's velocity would be unstable from b = k h/2 on.
///
/// Third law: both wrenches have one line of action, through the tool's origin. The reaction of such a fluid on its
/// owner acts one step later, when it is known.
class EffectStage {
 public:
  EffectStage(std::span<const EffectSettings> effects, std::size_t things, std::size_t tools);

  bool is_empty() const { return effects_.empty(); }
  /// Clears the memory of the effects for this tool, whose user changed or left.
  void forget(std::size_t tool) noexcept;
  /// Adds the effects to `wrench_W` of implicit and external things. External things also get them as applied wrenches.
  /// No allocation.
  /// In      things  bodies first, in the order of the scene
  ///         tools   couplings of the tools that a hand moves
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
  std::vector<EffectMemory> memories_;  ///< index: tool · effects + effect
  std::vector<TouchDrag> flows_;        ///< same index: the fluid around a massless tool in the last step
  std::vector<int> hands_;              ///< number of couplings at each thing
  std::vector<Twist> velocities_;       ///< velocities of the things' centres, updated by the effects so far
};

}  // namespace tandem::physics
