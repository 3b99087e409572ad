// What the world is made of inside: its bodies and tools, what holds them, and what one step works with.
// Private to the world: world.cpp has what is there and how it is read, world_hold.cpp what hands do,
// world_step.cpp the step, world_energy.cpp what it holds.
#pragma once

#include <boost/container/static_vector.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/haptics/coupling/rendered_coupling.hpp"
#include "common/physics/effect_stage.hpp"
#include "common/physics/molecular_forces.hpp"
#include "common/physics/tool_hand.hpp"
#include "common/physics/touch/touch_limits.hpp"
#include "common/physics/touch/touch_stage.hpp"
#include "common/physics/world.hpp"

namespace tandem::physics {

struct WorldBody {
  RigidBody rigid;
  const BodyDescription* description = nullptr;
  JointLaw anchor = {};    ///< as the description says
  int hands = 0;           ///< tools that hold it
  int adopted = 0;         ///< steps that the touch stage still steps it for, after something led has touched it
  int kept = 0;            ///< the same, because somebody asked
  bool is_absent = false;  ///< until somebody says where it is
  bool waits = false;  ///< at its start, for the tool that holds it from the start, until something takes or touches it

  /// It stays the touch stage's, and what it touches becomes that too.
  bool makes_implicit() const { return hands > 0 || kept > 0; }
  bool is_free() const { return !makes_implicit() && adopted == 0; }
  bool has_anchor() const { return description->anchor.has_value() && !rigid.is_static(); }
  const docking::Molecule* molecule() const { return description->molecule.get(); }
  RigidState start() const { return {description->X_WB, Twist{}}; }
};

struct WorldTool {
  RigidBody rigid;
  const ToolDescription* description = nullptr;
  ToolHand hand;
  haptics::CouplingParameters coupling_bounds = haptics::kNoCouplingBounds;
  bool is_active = false;
  std::optional<std::size_t> held = {};            ///< index of a body
  Pose X_BT = {};                                  ///< its place on the held body
  std::optional<std::size_t> passes_through = {};  ///< body that was released with the tool inside
  SoftContact soft = {};                           ///< told from outside
  std::optional<std::size_t> pull = {};            ///< its place among this step's pulls

  bool is_free() const { return is_active && !held; }
  bool has_mass() const { return hand.dynamics() == haptics::ToolDynamics::kWithMass; }
  RigidState start() const { return {description->X_WT, Twist{}}; }
};

/// A body that tools touch belongs to the touch stage, and for so long after: taps and slides do not change its owner
/// at every bounce.
inline constexpr double kAdoption_s = 0.25;

/// Equal to no pose.
inline const Pose kNowhere{Vec3::Constant(std::numeric_limits<double>::quiet_NaN()), Quat::Identity()};

/// Of tool i in a set of hands; there are at most as many tools as users.
inline std::uint32_t bit_of(std::size_t tool) {
  return tool < 32 ? std::uint32_t{1} << tool : 0;
}

// Order of members: those that refer to bodies are destroyed before them.
struct World::Impl {
  Impl(std::shared_ptr<const WorldDescription> world, std::unique_ptr<FreeBodies> free_bodies,
       std::unique_ptr<SoftBodies> soft_bodies);

  double step_s() const { return scene->step_s; }
  int steps_in(double seconds) const { return static_cast<int>(std::ceil(seconds / step_s())); }
  int adoption_steps() const { return steps_in(kAdoption_s); }

  // What is there.
  WorldBody* body_of(BodyId id);
  RigidState tool_state(const WorldTool& tool) const;
  std::size_t thing_of(const WorldTool& tool) const;
  std::size_t soft_index_of(std::size_t thing) const;
  std::uint32_t holders_of(std::size_t body) const;
  /// Calls `change` on the body, whose owner may be another one then.
  template <class Change>
  void change_owner(WorldBody& body, const Change& change);

  // What hands do.
  void attach(WorldTool& tool, std::size_t body, const Pose& X_BT);
  void detach(WorldTool& tool);
  double distance_m(const WorldTool& tool, std::size_t body, double limit_m) const;
  haptics::CouplingParameters coupling_of(const WorldTool& tool) const;
  void couple(WorldTool& tool) const;

  // The step, in this order.
  TickFaults apply_field() noexcept;
  void find_field() noexcept;
  void damp_and_ramp() noexcept;
  TickFaults step_touch() noexcept;
  void describe_things() noexcept;
  void add_soft_wrenches() noexcept;
  void describe_joints() noexcept;
  void describe_pulls() noexcept;
  void add_effects() noexcept;
  void keep_waiting() noexcept;
  /// Of bodies that are free, or of all else.
  TickFaults limit_or_restore_all(bool are_free) noexcept;
  TickFaults limit_or_restore(std::size_t body) noexcept;
  TickFaults limit_speed(RigidBody& rigid) noexcept;
  void adopt() noexcept;
  TickFaults settle_hands() noexcept;
  TickFaults step_soft() noexcept;
  void end_passing_through(WorldTool& tool) noexcept;

  // The accounts.
  double mechanical_energy_j() const;
  double coupling_energy_j(std::uint32_t without_hands) const;

  std::shared_ptr<const WorldDescription> scene;
  SceneCoupling coupling;  ///< the scene's, as somebody has set it
  std::vector<WorldBody> bodies;
  std::vector<WorldTool> tools;
  MolecularForces field;
  std::vector<Pose> poses;             ///< of molecules, where the field was found
  std::vector<Wrench> wrenches;        ///< of the field, likewise
  bool is_field_limited = false;       ///< likewise
  double field_energy_kj_per_mol = 0;  ///< as the last step began; and what is felt of it
  double field_energy_j = 0;
  std::vector<TouchThing> things;  ///< bodies, then tools
  std::vector<TouchCoupling> pulls;
  std::vector<TouchJoint> touch_joints;         ///< anchors
  std::vector<std::optional<Pose>> soft_tools;  ///< where tools are, then bodies; none: touches nothing
  TouchStage touch;
  std::unique_ptr<SoftBodies> soft;  ///< null without soft bodies
  EffectStage effects;
  std::vector<BodyId> put_back;  ///< in the last step
  bool puts_all_back = false;    ///< in the next
  bool is_answered = false;      ///< a step is, and not finished
  std::uint64_t steps_done = 0;
  std::unique_ptr<FreeBodies> free;
};

template <class Change>
void World::Impl::change_owner(WorldBody& body, const Change& change) {
  const auto index = static_cast<std::size_t>(&body - bodies.data());
  const bool was_free = body.is_free();
  change(body);
  if (was_free && !body.is_free()) free->remove(index);
  if (!was_free && body.is_free()) free->add(index, body.rigid);
}

}  // namespace tandem::physics
