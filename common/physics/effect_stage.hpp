// Applies the scene's effects (common/physics/effects) to the tools in a step. Private to the world.
#pragma once

#include <span>
#include <vector>

#include "common/physics/effects/effect.hpp"
#include "common/physics/touch/touch_stage.hpp"

namespace tandem::physics {

/// Applies effects as external wrenches on tools, and the opposite wrenches on the bodies that own the effects.
///
/// Effects are applied one after another. Each effect uses the velocities that result from the previous ones.
/// Overlapping dampers therefore slow a tool as a single damper would, and never reverse its motion.
/// Rules:
/// * Contact forces are those of the last step.
/// * Effects that a body owns do not act on a tool that holds this body.
/// * If several tools hold a body, each transmits an equal part of an effect to it.
///
/// Massless tools: such a tool is displaced against the spring k of its coupling. For an effect, this corresponds to a
/// mass of k h², with the step h. Fluids around such a tool are part of TouchStage's solution (TouchDrag). A drag
/// computed from the velocity of the last step would be unstable for a damping b ≥ k h/2.
///
/// Third law: the forces on the tool and on the effect's owner have the same line of action, through the tool's origin.
/// An exception in time: the drag of a fluid on a massless tool is known only after the solution, so the reaction on
/// the owner acts one step late.
class EffectStage {
 public:
  EffectStage(std::span<const EffectSettings> effects, std::size_t things, std::size_t tools);

  bool is_empty() const { return effects_.empty(); }
  /// Resets the effects' state for this tool. Called when the tool's user changes or leaves.
  void forget(std::size_t tool) noexcept;
  /// Adds the wrenches of the effects to `wrench_W` of implicit and external objects. For external objects, the
  /// wrenches are also applied to the rigid body (RigidBody::apply_wrench()), because another component moves it.
  /// Allocates nothing.
  /// In      things  bodies first, in the order of the scene
  ///         tools   couplings of the tools that are coupled to a hand
  void apply(double time_s, double step_s, std::span<TouchThing> things, std::span<const TouchCoupling> tools,
             const TouchStage& touch) noexcept;

 private:
  /// One effect and one tool in the current step.
  struct Meeting;

  void apply_one(double time_s, double step_s, std::size_t index, std::span<TouchThing> things,
                 const TouchCoupling& tool, const TouchStage& touch) noexcept;
  void flow_round(const Meeting& meeting, const EffectInput& input, std::span<TouchThing> things,
                  TouchDrag& flow) noexcept;
  void push(double step_s, TouchThing& thing, std::size_t index, const Wrench& wrench_W, const Vec3& p_W) noexcept;

  std::vector<Effect> effects_;
  std::vector<EffectMemory> memories_;  ///< index: tool · number of effects + effect
  std::vector<TouchDrag> flows_;        ///< fluid around a massless tool in the last step; same index
  std::vector<int> hands_;              ///< number of couplings of each object
  std::vector<Twist> velocities_;       ///< velocities of the centres, including the effects applied so far
};

}  // namespace tandem::physics
