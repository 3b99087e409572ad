// Internals of the world: bodies, tools, couplings, and the working data of a step. Private to the world. Sources:
// world.cpp (construction, access), world_hold.cpp (grabs, couplings), world_step.cpp, world_energy.cpp.
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
  JointLaw anchor = {};    ///< anchor given in the description
  int hands = 0;           ///< number of tools that hold the body
  int adopted = 0;         ///< remaining steps in the touch stage after the last contact
  int kept = 0;            ///< remaining steps for which keep_implicit() keeps the body in the touch stage
  bool is_absent = false;  ///< true: the body is excluded, neither free nor in the touch stage
  /// True: the body is kept at rest at its start pose, until the tool that holds it from the start, or another tool,
  /// takes or touches it.
  bool waits = false;

  /// Returns whether the body stays in the touch stage, where bodies that it touches become implicit as well.
  bool makes_implicit() const { return hands > 0 || kept > 0; }
  /// Returns whether FreeBodies moves the body.
  bool is_free() const { return !is_absent && !makes_implicit() && adopted == 0; }
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
  std::optional<std::size_t> held = {};            ///< index of the held body
  Pose X_BT = {};                                  ///< grip: pose of the tool relative to the held body
  std::optional<std::size_t> passes_through = {};  ///< released body that the tool may still overlap
  SoftContact soft = {};                           ///< contact from set_soft_contact()
  std::optional<std::size_t> pull = {};            ///< index in `pulls` of this step

  bool is_free() const { return is_active && !held; }
  bool has_mass() const { return hand.dynamics() == haptics::ToolDynamics::kWithMass; }
  RigidState start() const { return {description->X_WT, Twist{}}; }
};

/// Time for which a body remains in the touch stage after its last contact with a tool. Without it, a contact with
/// interruptions (tapping, sliding) would move the body between the two solvers at every interruption.
inline constexpr double kAdoption_s = 0.25;

/// A pose whose position is NaN. It is unequal to every pose, also to itself.
inline const Pose kNowhere{Vec3::Constant(std::numeric_limits<double>::quiet_NaN()), Quat::Identity()};

/// Returns the bit of a tool in a set of tools. There are at most as many tools as users.
inline std::uint32_t bit_of(std::size_t tool) {
  return tool < 32 ? std::uint32_t{1} << tool : 0;
}

// Members that refer to bodies are declared after `bodies`, so that they are destroyed before it.
struct World::Impl {
  Impl(std::shared_ptr<const WorldDescription> world, std::unique_ptr<FreeBodies> free_bodies,
       std::unique_ptr<SoftBodies> soft_bodies);

  double step_s() const { return scene->step_s; }
  int steps_in(double seconds) const { return static_cast<int>(std::ceil(seconds / step_s())); }
  int adoption_steps() const { return steps_in(kAdoption_s); }

  // Access to bodies and tools.
  WorldBody* body_of(BodyId id);
  RigidState tool_state(const WorldTool& tool) const;
  std::size_t thing_of(const WorldTool& tool) const;
  std::size_t soft_index_of(std::size_t thing) const;
  std::uint32_t holders_of(std::size_t body) const;
  /// Calls `change` on the body. If this moves the body between the free bodies and the touch stage, transfers the
  /// body.
  template <class Change>
  void change_owner(WorldBody& body, const Change& change);

  // Coupling of tools to bodies and hands.
  void attach(WorldTool& tool, std::size_t body, const Pose& X_BT);
  void detach(WorldTool& tool);
  double distance_m(const WorldTool& tool, std::size_t body, double limit_m) const;
  haptics::CouplingParameters coupling_of(const WorldTool& tool) const;
  void couple(WorldTool& tool) const;

  // Parts of a step, in order of execution.
  TickFaults apply_field() noexcept;
  void find_field() noexcept;
  void damp_and_ramp() noexcept;
  void ramp_gravity() noexcept;
  TickFaults step_touch() noexcept;
  void describe_things() noexcept;
  void add_soft_wrenches() noexcept;
  void describe_joints() noexcept;
  void describe_pulls() noexcept;
  void add_effects() noexcept;
  void keep_waiting() noexcept;
  /// Limits or restores the free bodies (are_free), or all other bodies and the tools.
  TickFaults limit_or_restore_all(bool are_free) noexcept;
  TickFaults limit_or_restore(std::size_t body) noexcept;
  TickFaults limit_speed(RigidBody& rigid) noexcept;
  void adopt() noexcept;
  TickFaults settle_hands() noexcept;
  TickFaults step_soft() noexcept;
  void end_passing_through(WorldTool& tool) noexcept;

  // Energies of the world [J].
  double mechanical_energy_j() const;
  double coupling_energy_j(std::uint32_t without_hands) const;

  std::shared_ptr<const WorldDescription> scene;
  Vec3 gravity;            ///< current gravity of the touch stage [m/s²]
  Vec3 gravity_target;     ///< gravity of free bodies, and of the touch stage at the end of the ramp
  int gravity_steps = 0;   ///< remaining steps of the ramp
  SceneCoupling coupling;  ///< current coupling of the scene
  std::vector<WorldBody> bodies;
  std::vector<WorldTool> tools;
  MolecularForces field;
  std::vector<Pose> poses;             ///< poses of the molecules for which the field was computed
  std::vector<Wrench> wrenches;        ///< wrenches of the field at these poses
  bool is_field_limited = false;       ///< whether the field was limited at these poses
  double field_energy_kj_per_mol = 0;  ///< energy at the start of the last step
  double field_energy_j = 0;
  std::vector<TouchThing> things;  ///< bodies, then tools
  std::vector<TouchCoupling> pulls;
  std::vector<TouchJoint> touch_joints;  ///< anchors of the bodies
  /// Poses of the tools, then of the bodies; empty for an absent object, which has no soft contact.
  std::vector<std::optional<Pose>> soft_tools;
  TouchStage touch;
  std::unique_ptr<SoftBodies> soft;  ///< null if there are no soft bodies
  EffectStage effects;
  std::vector<BodyId> returned_bodies;  ///< bodies that the last step returned to their start poses
  bool puts_all_back = false;           ///< whether the next step returns all bodies to their start poses
  bool is_answered = false;             ///< whether answer() was called and finish() was not
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
