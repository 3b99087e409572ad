#include "common/world/world.hpp"

#include <algorithm>
#include <boost/container/static_vector.hpp>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "common/coupling/coupling_ranges.hpp"
#include "common/world/anchor.hpp"
#include "common/world/effect_stage.hpp"
#include "common/world/molecular_forces.hpp"
#include "common/world/tool_hand.hpp"
#include "common/world/touch_stage.hpp"

namespace tandem {
namespace {

/// How fast a tool without a handle comes to rest. Ours: gone in a quarter of a second, without a jerk.
constexpr double kIdleDamping_per_s = 20;

/// A tool let go this deep in a body, or less, was pressing on it and goes on doing so; deeper, it was inside.
constexpr double kPressedDepth_m = 2e-4;

/// Of a thing that cannot be touched: what limits its turning.
constexpr double kRadiusOfNone_m = 0.01;

/// Of the ball about the centre of mass.
double radius_m(const TouchModel& touch, const MassProperties& mass) {
  return touch.can_be_touched() ? touch.radius_m + mass.X_BC.p.norm() : kRadiusOfNone_m;
}

RigidBody make_body(const BodyDescription& body) {
  return {body.mass, body.traits, radius_m(body.touch, body.mass), body.X_WB};
}

RigidBody make_tool(const ToolDescription& tool) {
  const BodyTraits traits{tool.friction, 0, 0, 0, false};
  return {tool.mass, traits, radius_m(tool.touch, tool.mass), tool.X_WT};
}

/// What joins a thing to somewhere else in this step and the next ones.
struct Join {
  JointLaw law;
  RigidState target;         ///< of the frame that is joined
  Vec3 p_BJ = Vec3::Zero();  ///< of a body's: where that is
  double share = 0;

  bool is_there() const { return share > 0; }
};

/// The same of a body, by a user who has a copy of it.
struct CopyJoin {
  std::size_t body = 0;
  JointLaw law;
  RigidState target;         ///< of the body
  Vec3 p_BJ = Vec3::Zero();  ///< where it is joined
  std::size_t tie = 0;       ///< its place among this step's ties
};

struct Body {
  RigidBody rigid;
  const BodyDescription* description = nullptr;
  JointLaw anchor = {};  ///< as the description says
  Join join = {};
  int hands = 0;    ///< tools that hold it
  int copies = 0;   ///< users whose copies pull it
  int adopted = 0;  ///< steps that the touch stage still steps it for, after something led has touched it
  int kept = 0;     ///< the same, because somebody asked

  /// It stays the touch stage's, and what it touches becomes that too.
  bool is_led() const { return hands > 0 || copies > 0 || kept > 0 || join.is_there(); }
  bool is_free() const { return !is_led() && adopted == 0; }
  bool has_anchor() const { return description->anchor.has_value() && !rigid.is_static(); }
  const Molecule* molecule() const { return description->molecule.get(); }
  RigidState start() const { return {description->X_WB, Twist{}}; }
};

/// The frame at `p_BJ` on a body, with the body's axes.
RigidState joined_frame(const RigidState& body, const Vec3& p_BJ) {
  const Vec3 lever = body.X.q * p_BJ;
  return {{body.X.p + lever, body.X.q}, {body.V.v + body.V.w.cross(lever), body.V.w}};
}
Pose joined_pose(const Pose& X_WB, const Vec3& p_BJ) {
  return {X_WB * p_BJ, X_WB.q};
}

bool is_finite(const RigidState& state) {
  return is_finite(state.X) && is_finite(state.V);
}

/// A body that tools touch belongs to the touch stage, and for so long after: taps and slides do not change its owner
/// at every bounce.
constexpr double kAdoption_s = 0.25;

/// Of tool i in a set of hands; there are at most as many tools as users.
std::uint32_t bit_of(std::size_t tool) {
  return tool < 32 ? std::uint32_t{1} << tool : 0;
}

struct Tool {
  RigidBody rigid;
  const ToolDescription* description = nullptr;
  ToolHand hand;
  bool is_active = false;
  std::optional<std::size_t> held;            ///< index of a body
  Pose X_BT;                                  ///< its place on the held body
  std::optional<std::size_t> passes_through;  ///< body that was released with the tool inside
  Join join = {};
  boost::container::static_vector<CopyJoin, kMostCopies> copies = {};
  RigidState tool_there = {};  ///< with copies: the client's tool, which they were touched with
  double copies_share = 0;
  SoftContact soft = {};                 ///< told from outside
  std::optional<std::size_t> pull = {};  ///< its place among this step's pulls
  std::optional<std::size_t> tie = {};   ///< and among the ties

  bool is_free() const { return is_active && !held; }
  /// Its user acts by copies alone.
  bool is_away() const { return copies_share >= 1; }
  bool touches() const { return is_free() && !is_away(); }
  /// By a hand, or by what holds its place.
  bool is_pulled() const { return hand.pulls() || join.is_there(); }
  bool has_mass() const { return hand.dynamics() == ToolDynamics::kWithMass; }
  RigidState start() const { return {description->X_WT, Twist{}}; }
};

TouchStage::Limits touch_limits(const WorldDescription& world) {
  return {world.bodies.size() + world.tools.size(),
          world.tools.size(),
          2 * world.bodies.size() + (1 + kMostCopies) * world.tools.size(),
          world.limits.contact_pairs,
          {world.limits.contact_points},
          world.limits.body_speed_m_per_s};
}

}  // namespace

// Order of members: those that refer to bodies are destroyed before them.
struct World::Impl {
  Impl(std::shared_ptr<const WorldDescription> world, std::unique_ptr<FreeBodies> free_bodies,
       std::unique_ptr<SoftBodies> soft_bodies);

  double step_s() const { return scene->step_s; }
  RigidState tool_state(const Tool& tool) const;
  void attach(Tool& tool, std::size_t body, const Pose& X_BT);
  void detach(Tool& tool);
  double distance_m(const Tool& tool, std::size_t body, double limit_m) const;
  CouplingParameters coupling_of(const Tool& tool) const;

  Body* body_of(BodyId id);
  /// Calls `change` on the body, whose owner may be another one then.
  template <class Change>
  void change_owner(Body& body, const Change& change);
  int steps_in(double seconds) const { return static_cast<int>(std::ceil(seconds / step_s())); }

  TickFaults apply_field() noexcept;
  void damp_and_ramp() noexcept;
  void describe_things() noexcept;
  void describe_ties() noexcept;
  void place_away(Tool& tool) noexcept;
  void forget_copies(Tool& tool) noexcept;
  void anchor_free_bodies() noexcept;
  void add_soft_wrenches() noexcept;
  void add_effects() noexcept;
  TickFaults step_soft() noexcept;
  std::size_t soft_index_of(std::size_t thing) const;
  TickFaults step_touch() noexcept;
  void adopt() noexcept;
  int adoption_steps() const { return steps_in(kAdoption_s); }
  TickFaults settle_hands() noexcept;
  TickFaults limit_speed(RigidBody& rigid) noexcept;
  TickFaults guard(std::size_t body) noexcept;
  TickFaults guard_all() noexcept;
  void end_passing_through(Tool& tool) noexcept;
  std::size_t thing_of(const Tool& tool) const;
  std::uint32_t holders_of(std::size_t body) const;
  double coupling_energy_j(std::uint32_t without_hands) const;
  double field_energy_j() const;

  std::shared_ptr<const WorldDescription> scene;
  CouplingParameters coupling;
  std::vector<Body> bodies;
  std::vector<Tool> tools;
  MolecularForces field;
  std::vector<Pose> poses;         ///< scratch of apply_field()
  std::vector<Wrench> wrenches;    ///< likewise
  std::vector<TouchThing> things;  ///< bodies, then tools
  std::vector<TouchPull> pulls;
  std::vector<std::size_t> pulling;  ///< tool of pulls[i]
  std::vector<TouchTie> ties;        ///< anchors and joints
  std::vector<SoftTool> soft_tools;  ///< tools, then bodies
  TouchStage touch;
  std::unique_ptr<SoftBodies> soft;  ///< null without soft bodies
  EffectStage effects;
  std::vector<EffectTool> effect_tools;  ///< scratch of add_effects()
  std::uint64_t steps_done = 0;
  std::unique_ptr<FreeBodies> free;
};

World::Impl::Impl(std::shared_ptr<const WorldDescription> world, std::unique_ptr<FreeBodies> free_bodies,
                  std::unique_ptr<SoftBodies> soft_bodies)
    : scene(std::move(world)),
      coupling(scene->coupling.parameters),
      field(*scene),
      touch(touch_limits(*scene)),
      soft(std::move(soft_bodies)),
      effects(scene->effects, scene->bodies.size() + scene->tools.size(), scene->tools.size()),
      free(std::move(free_bodies)) {
  for (const BodyDescription& body : scene->bodies) {
    bodies.push_back({make_body(body), &body});
    if (body.anchor) bodies.back().anchor.set(*body.anchor, 1);
  }
  for (const ToolDescription& tool : scene->tools) {
    tools.push_back({make_tool(tool), &tool, ToolHand(scene->coupling.law, coupling), false, {}, {}, {}});
  }
  things.resize(bodies.size() + tools.size());
  pulls.reserve(tools.size());
  pulling.reserve(tools.size());
  ties.reserve(2 * bodies.size() + (1 + kMostCopies) * tools.size());
  effect_tools.reserve(tools.size());
  soft_tools.resize(things.size());
  poses.resize(bodies.size());
  wrenches.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) free->add(i, bodies[i].rigid);
}

RigidState World::Impl::tool_state(const Tool& tool) const {
  if (!tool.held) return tool.rigid.state();
  const RigidBody& body = bodies[*tool.held].rigid;
  const RigidState of_body = body.state();
  const Pose X_WT = of_body.X * tool.X_BT;
  return {X_WT, {body.velocity_at_W(X_WT.p), of_body.V.w}};
}

void World::Impl::attach(Tool& tool, std::size_t index, const Pose& X_BT) {
  change_owner(bodies[index], [](Body& body) { ++body.hands; });
  tool.soft = {};
  tool.passes_through.reset();
  tool.held = index;
  tool.X_BT = X_BT;
  tool.hand.set_coupling(coupling_of(tool));
}

void World::Impl::detach(Tool& tool) {
  tool.rigid.set_state(tool_state(tool));
  tool.soft = {};
  Body& body = bodies[*tool.held];
  // It is free again when no tool has touched it for a while (adopt()).
  --body.hands;
  body.adopted = adoption_steps();
  const Pose X_WT = tool.rigid.state().X, X_WB = body.rigid.state().X;
  if (overlaps(tool.description->touch, X_WT, body.description->touch, X_WB, kPressedDepth_m))
    tool.passes_through = tool.held;
  tool.held.reset();
  tool.hand.set_coupling(coupling_of(tool));
}

Body* World::Impl::body_of(BodyId id) {
  return id.is_valid() && id.value <= bodies.size() ? &bodies[id.value - 1] : nullptr;
}

template <class Change>
void World::Impl::change_owner(Body& body, const Change& change) {
  const auto index = static_cast<std::size_t>(&body - bodies.data());
  const bool was_free = body.is_free();
  change(body);
  if (was_free && !body.is_free()) free->remove(index);
  if (!was_free && body.is_free()) free->add(index, body.rigid);
}

CouplingParameters World::Impl::coupling_of(const Tool& tool) const {
  const RigidBody& moved = tool.held ? bodies[*tool.held].rigid : tool.rigid;
  return coupling_in_force(scene->coupling, coupling, moved_mass(moved.mass(), tool.held.has_value()));
}

/// To the body's surface; of a molecule, from the tool's origin to the nearest atom.
double World::Impl::distance_m(const Tool& tool, std::size_t index, double limit_m) const {
  const Body& body = bodies[index];
  const Pose X_WT = tool.rigid.state().X;
  const Pose X_WB = body.rigid.state().X;
  if (body.molecule() == nullptr) {
    return tandem::distance_m(tool.description->touch, X_WT, body.description->touch, X_WB, limit_m);
  }
  const double scale = scene->field.scale.metres_per_angstrom;
  const Vec3 tool_B = X_WB.inverse() * X_WT.p;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vec3& atom : body.molecule()->positions_angstrom) {
    nearest = std::min(nearest, (scale * atom - tool_B).norm());
  }
  return nearest;
}

std::size_t World::Impl::thing_of(const Tool& tool) const {
  return tool.held ? *tool.held : bodies.size() + static_cast<std::size_t>(&tool - tools.data());
}

std::uint32_t World::Impl::holders_of(std::size_t body) const {
  std::uint32_t holders = 0;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const auto is_copy = [body](const CopyJoin& copy) { return copy.body == body; };
    const bool has_copy = std::any_of(tools[i].copies.begin(), tools[i].copies.end(), is_copy);
    if (tools[i].held == body || has_copy) holders |= bit_of(i);
  }
  return holders;
}

double World::Impl::coupling_energy_j(std::uint32_t without_hands) const {
  double energy = 0;
  const auto add = [&energy](const Join& join, const Pose& X) {
    if (join.is_there()) energy += tandem::stored_energy_j(join.law.joint(), join.target.X, X);
  };
  for (const Body& body : bodies) add(body.join, joined_pose(body.rigid.state().X, body.join.p_BJ));
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const Tool& tool = tools[i];
    if (!tool.is_active || tool.hand.dynamics() == ToolDynamics::kAtHandle) continue;
    if ((without_hands & bit_of(i)) != 0) continue;
    const Pose X_WT = tool_state(tool).X;
    energy += tool.hand.stored_energy_j(X_WT);
    add(tool.join, X_WT);
    for (const CopyJoin& copy : tool.copies) {
      energy += tandem::stored_energy_j(copy.law.joint(), joined_pose(copy.target.X, copy.p_BJ),
                                        joined_pose(bodies[copy.body].rigid.state().X, copy.p_BJ));
    }
  }
  return energy;
}

double World::Impl::field_energy_j() const {
  const MolecularScale& scale = scene->field.scale;
  return scale.newtons_per_kcal_per_mol_angstrom * scale.metres_per_angstrom * field.energy_kj_per_mol() /
         kKilojoulesPerKilocalorie;
}

TickFaults World::Impl::apply_field() noexcept {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].molecule() == nullptr) continue;
    poses[i] = bodies[i].rigid.state().X;
    wrenches[i] = Wrench{};
  }
  const bool is_limited = field.add_wrenches(poses, wrenches);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    // Held ones feel it in the touch stage (describe_things()).
    if (bodies[i].molecule() != nullptr && bodies[i].is_free()) {
      bodies[i].rigid.apply_wrench(wrenches[i], poses[i].p);
    }
  }
  return is_limited ? TickFaults{kFaultFieldLimited} : 0;
}

void World::Impl::damp_and_ramp() noexcept {
  for (Body& body : bodies) {
    if (!body.rigid.is_static()) body.rigid.damp(step_s(), 0);
  }
  for (Tool& tool : tools) {
    tool.hand.advance(step_s());
    if (tool.is_free() && !tool.is_pulled()) tool.rigid.damp(step_s(), kIdleDamping_per_s);
  }
}

/// Guests' weight and field are told as well, so that the stage foresees how they move.
void World::Impl::describe_things() noexcept {
  using Role = TouchThing::Role;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Body& body = bodies[i];
    TouchThing& thing = things[i];
    thing = {&body.rigid, &body.description->touch, Role::kStatic, body.is_led(), holders_of(i)};
    if (body.rigid.is_static()) continue;
    thing.role = body.is_free() ? Role::kGuest : Role::kOurs;
    thing.wrench_W = body.rigid.weight_W(scene->gravity_m_per_s2) * (1 - body.join.share);
    if (body.molecule() == nullptr) continue;
    const Vec3 lever = poses[i].p - body.rigid.centre_W();
    thing.wrench_W += {wrenches[i].f, wrenches[i].t + lever.cross(wrenches[i].f)};
  }
  for (std::size_t i = 0; i < tools.size(); ++i) {
    Tool& tool = tools[i];
    place_away(tool);
    const Role role = tool.touches() ? Role::kOurs : Role::kAbsent;
    things[bodies.size() + i] = {&tool.rigid, &tool.description->touch, role, true,
                                 bit_of(i),   tool.hand.dynamics(),     {},   tool.passes_through};
    // A body keeps its mass in a massless tool, but not its freedom in one that is at the handle.
    if (tool.held && tool.hand.dynamics() == ToolDynamics::kAtHandle)
      things[*tool.held].dynamics = tool.hand.dynamics();
  }
}

void World::Impl::describe_ties() noexcept {
  ties.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Body& body = bodies[i];
    if (body.has_anchor()) ties.push_back({i, &body.anchor, body.start(), body.rigid.state().X});
    if (!body.join.is_there()) continue;
    ties.push_back({i, &body.join.law, body.join.target, joined_pose(body.rigid.state().X, body.join.p_BJ)});
  }
  for (Tool& tool : tools) {
    for (CopyJoin& copy : tool.copies) {
      copy.tie = ties.size();
      const Pose X_WJ = joined_pose(bodies[copy.body].rigid.state().X, copy.p_BJ);
      ties.push_back({copy.body, &copy.law, joined_frame(copy.target, copy.p_BJ), X_WJ});
    }
    tool.tie.reset();
    const bool is_joined = tool.is_active && tool.join.is_there() && tool.hand.dynamics() != ToolDynamics::kAtHandle;
    if (!is_joined) continue;
    tool.tie = ties.size();
    ties.push_back({thing_of(tool), &tool.join.law, tool.join.target, tool_state(tool).X});
  }
}

/// Where its user's client has it, carried over from copy to body, so that it can touch again from there.
void World::Impl::place_away(Tool& tool) noexcept {
  if (!tool.is_away() || !tool.is_free()) return;
  RigidState state = tool.tool_there;
  if (!tool.copies.empty()) {
    const CopyJoin& copy = tool.copies.front();
    state.X = bodies[copy.body].rigid.state().X * copy.target.X.inverse() * state.X;
  }
  tool.rigid.set_state(state);
}

void World::Impl::forget_copies(Tool& tool) noexcept {
  for (const CopyJoin& copy : tool.copies) {
    change_owner(bodies[copy.body], [](Body& body) { --body.copies; });
  }
  tool.copies.clear();
  tool.copies_share = 0;
}

/// A guest's anchor was solved with what touched it; of all others, alone.
void World::Impl::anchor_free_bodies() noexcept {
  for (const TouchTie& tie : ties) {
    Body* const body = tie.thing < bodies.size() ? &bodies[tie.thing] : nullptr;
    if (body == nullptr || !body->is_free()) continue;
    if (tie.is_solved) {
      body->rigid.apply_wrench(tie.wrench_W, tie.X_WT.p);
      continue;
    }
    const Wrench others_W = body->rigid.applied_W() + body->rigid.weight_W(scene->gravity_m_per_s2);
    const Wrench wrench_W = anchor_wrench_W(body->rigid, tie.target.X, *body->description->anchor, others_W, step_s());
    body->rigid.apply_wrench(wrench_W, body->rigid.centre_W());
  }
}

/// Soft bodies list tools first.
std::size_t World::Impl::soft_index_of(std::size_t thing) const {
  return thing < bodies.size() ? tools.size() + thing : thing - bodies.size();
}

/// Evaluated where the things are now: soft bodies are soft enough for that to be stable.
void World::Impl::add_soft_wrenches() noexcept {
  const auto add = [](TouchThing& thing, const SoftContact& contact) {
    if (thing.role != TouchThing::Role::kOurs && thing.role != TouchThing::Role::kGuest) return;
    const Pose X_WT = thing.rigid->state().X;
    const Wrench wrench = soft_wrench(contact, X_WT);
    const Vec3 lever = X_WT.p - thing.rigid->centre_W();
    thing.wrench_W += {wrench.f, wrench.t + lever.cross(wrench.f)};
    if (thing.role == TouchThing::Role::kGuest) thing.rigid->apply_wrench(wrench, X_WT.p);
  };
  if (soft) {
    for (std::size_t i = 0; i < things.size(); ++i) add(things[i], soft->contact(soft_index_of(i)));
    return;
  }
  for (const Tool& tool : tools) {
    if (tool.soft.trust_radius_m > 0) add(things[thing_of(tool)], tool.soft);
  }
}

/// On tools that a hand moves: one that floats would be blown away. `pulls` are those of this step.
void World::Impl::add_effects() noexcept {
  effect_tools.clear();
  for (std::size_t i = 0; i < pulls.size(); ++i) {
    const TouchPull& pull = pulls[i];
    const bool is_massless = things[pull.thing].dynamics == ToolDynamics::kMassless;
    CouplingTether tether = is_massless ? pull.hand->tether(pull.X_WT) : CouplingTether{};
    const Join& join = tools[pulling[i]].join;
    if (is_massless && join.is_there()) {
      tether.stiffness_n_per_m += join.law.joint().stiffness_n_per_m;
      tether.stiffness_n_m_per_rad += join.law.joint().stiffness_n_m_per_rad;
    }
    effect_tools.push_back({pulling[i], pull.thing, pull.X_WT, tether});
  }
  for (std::size_t i = 0; i < tools.size(); ++i) {
    if (!tools[i].hand.pulls()) effects.forget(i);
  }
  effects.apply(static_cast<double>(steps_done) * step_s(), step_s(), things, effect_tools, touch);
}

TickFaults World::Impl::step_soft() noexcept {
  for (std::size_t i = 0; i < things.size(); ++i) {
    const TouchThing& thing = things[i];
    soft_tools[soft_index_of(i)] = {thing.rigid->state().X, thing.role != TouchThing::Role::kAbsent};
  }
  return soft->advance(soft_tools);
}

TickFaults World::Impl::step_touch() noexcept {
  describe_things();
  add_soft_wrenches();
  describe_ties();
  pulls.clear();
  pulling.clear();
  for (std::size_t i = 0; i < tools.size(); ++i) {
    Tool& tool = tools[i];
    tool.pull.reset();
    // One that is away is not stepped, and of one that holds a body nothing of the coupling is left.
    if (!tool.is_active || !tool.hand.pulls() || tool.is_away()) continue;
    tool.pull = pulls.size();
    pulls.push_back({thing_of(tool), &tool.hand, tool_state(tool).X, {}});
    pulling.push_back(i);
  }
  if (!effects.is_empty()) add_effects();
  const TickFaults faults = touch.step(step_s(), things, pulls, ties);
  anchor_free_bodies();
  return faults;
}

/// What a tool touches, directly or through other bodies, is the touch stage's from the next step on, with all that it
/// leans on; when it has not been touched for a while, it is
/// free again.
void World::Impl::adopt() noexcept {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Body& body = bodies[i];
    if (body.rigid.is_static() || body.hands > 0) continue;
    change_owner(body, [&](Body& changed) {
      changed.adopted = touch.contact(i).is_reached ? adoption_steps() : std::max(0, changed.adopted - 1);
      changed.kept = std::max(0, changed.kept - 1);
    });
  }
}

TickFaults World::Impl::settle_hands() noexcept {
  TickFaults faults = 0;
  for (Tool& tool : tools) {
    if (!tool.is_active || (!tool.pull && !tool.tie && tool.copies.empty())) continue;
    const RigidState now = tool_state(tool);
    const Pose X_WT_before = tool.pull ? pulls[*tool.pull].X_WT : (tool.tie ? ties[*tool.tie].X_WT : now.X);
    const Wrench by_hand_W = tool.pull ? pulls[*tool.pull].wrench_W : Wrench{};
    const Wrench by_joint_W = tool.tie ? ties[*tool.tie].wrench_W : Wrench{};
    tool.hand.settle(X_WT_before, now, by_hand_W, by_joint_W);
    for (const CopyJoin& copy : tool.copies) {
      const TouchTie& tie = ties[copy.tie];
      tool.hand.settle_copy(tie.X_WT, joined_pose(bodies[copy.body].rigid.state().X, copy.p_BJ), tie.wrench_W);
    }
    if (tool.hand.is_saturated()) faults |= kFaultCouplingSaturated;
  }
  return faults;
}

TickFaults World::Impl::limit_speed(RigidBody& rigid) noexcept {
  return rigid.limit_speed(scene->limits.body_speed_m_per_s, step_s()) ? TickFaults{kFaultSpeedLimited} : 0;
}

TickFaults World::Impl::guard(std::size_t index) noexcept {
  Body& body = bodies[index];
  if (body.rigid.is_finite()) return limit_speed(body.rigid);
  // Out and in again, so that no contact keeps a number that is not finite.
  if (body.is_free()) free->remove(index);
  body.rigid.set_state(body.start());
  if (body.is_free()) free->add(index, body.rigid);
  return kFaultNotFinite;
}

TickFaults World::Impl::guard_all() noexcept {
  TickFaults faults = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!bodies[i].rigid.is_static()) faults |= guard(i);
  }
  for (Tool& tool : tools) {
    if (!tool.is_free()) continue;
    if (tool.rigid.is_finite()) {
      faults |= limit_speed(tool.rigid);
    } else {
      tool.rigid.set_state(tool.start());
      faults |= kFaultNotFinite;
    }
  }
  return faults;
}

void World::Impl::end_passing_through(Tool& tool) noexcept {
  if (!tool.passes_through || !tool.is_active) return;
  const Body& body = bodies[*tool.passes_through];
  const Pose X_WT = tool.rigid.state().X, X_WB = body.rigid.state().X;
  if (!overlaps(tool.description->touch, X_WT, body.description->touch, X_WB, 0)) tool.passes_through.reset();
}

World::World(std::shared_ptr<const WorldDescription> description, std::unique_ptr<FreeBodies> free_bodies,
             std::unique_ptr<SoftBodies> soft_bodies)
    : impl_(std::make_unique<Impl>(std::move(description), std::move(free_bodies), std::move(soft_bodies))) {}
World::~World() = default;

void World::activate_tool(std::size_t index) {
  Tool& tool = impl_->tools[index];
  if (tool.is_active) return;
  tool.is_active = true;
  tool.rigid.set_state(tool.start());
  const std::optional<std::size_t> held = impl_->scene->tools[index].holds_body;
  if (!held) return tool.hand.reset(impl_->coupling_of(tool));
  Body& body = impl_->bodies[*held];
  if (body.hands == 0) body.rigid.set_state(body.start());
  impl_->attach(tool, *held, body.start().X.inverse() * tool.start().X);
  tool.hand.reset(impl_->coupling_of(tool));
  tool.hand.anchor_at(impl_->tool_state(tool).X);
}

void World::deactivate_tool(std::size_t index) {
  Tool& tool = impl_->tools[index];
  if (!tool.is_active) return;
  release(index);
  tool.passes_through.reset();
  tool.hand.let_go();
  tool.hand.set_strength(1);
  tool.join = {};
  impl_->forget_copies(tool);
  tool.soft = {};
  impl_->effects.forget(index);
  tool.is_active = false;
}

void World::set_handle(std::size_t tool, const RigidState& handle) {
  if (is_finite(handle.X) && is_finite(handle.V)) impl_->tools[tool].hand.set_handle(handle);
}

void World::clear_handle(std::size_t index) {
  Tool& tool = impl_->tools[index];
  if (!tool.hand.has_handle()) return;
  if (tool.held) {
    tool.hand.anchor_at(impl_->tool_state(tool).X);
  } else {
    tool.hand.let_go();
  }
}

GrabResult World::grab(std::size_t index, BodyId id) {
  Tool& tool = impl_->tools[index];
  if (tool.held) return GrabResult::kAlreadyHolding;
  if (!tool.is_active) return GrabResult::kOutOfReach;
  if (id.value > impl_->bodies.size()) return GrabResult::kUnknownBody;
  if (id.is_valid() && !impl_->bodies[id.value - 1].description->is_graspable) return GrabResult::kNotGraspable;

  double nearest_m = impl_->scene->limits.grab_reach_m;
  std::optional<std::size_t> nearest;
  for (std::size_t i = 0; i < impl_->bodies.size(); ++i) {
    if (!impl_->bodies[i].description->is_graspable || (id.is_valid() && i + 1 != id.value)) continue;
    const double distance = impl_->distance_m(tool, i, nearest_m);
    // Of equally near ones the first: the order of the scene decides, not that of memory.
    if (distance < nearest_m || (distance == nearest_m && !nearest)) {
      nearest_m = distance;
      nearest = i;
    }
  }
  if (!nearest) return GrabResult::kOutOfReach;
  const Pose X_WT = tool.rigid.state().X;
  impl_->attach(tool, *nearest, impl_->bodies[*nearest].rigid.state().X.inverse() * X_WT);
  if (!tool.hand.has_handle()) tool.hand.anchor_at(X_WT);
  return GrabResult::kGrabbed;
}

void World::hold(std::size_t index, BodyId id, const Pose& X_BT) {
  Tool& tool = impl_->tools[index];
  const Body* const body = impl_->body_of(id);
  if (!tool.is_active || body == nullptr || body->rigid.is_static() || !is_finite(X_BT)) return;
  release(index);
  impl_->attach(tool, id.value - 1, X_BT);
  if (!tool.hand.has_handle()) tool.hand.anchor_at(impl_->tool_state(tool).X);
}

void World::move_grip(std::size_t index, const Pose& X_BT, double most_m) {
  constexpr double kTurnOfWay_rad_per_m = 10;
  Tool& tool = impl_->tools[index];
  if (!tool.held || !is_finite(X_BT)) return;
  const Vec3 turn = rotation_vector(X_BT.q * tool.X_BT.q.conjugate());
  tool.X_BT.p += clamped_to_length(X_BT.p - tool.X_BT.p, most_m);
  tool.X_BT.q = (quaternion_of(clamped_to_length(turn, most_m * kTurnOfWay_rad_per_m)) * tool.X_BT.q).normalized();
}

void World::release(std::size_t index) {
  Tool& tool = impl_->tools[index];
  if (!tool.held) return;
  impl_->detach(tool);
  if (!tool.hand.has_handle()) tool.hand.let_go();
}

void World::set_coupling(const CouplingParameters& parameters) {
  if (!is_usable(parameters)) return;
  impl_->coupling = parameters;
  for (Tool& tool : impl_->tools) tool.hand.set_coupling(impl_->coupling_of(tool));
}

void World::join_tool(std::size_t index, const RigidState& target, const Joint& joint, double share) {
  if (!is_finite(target) || !is_usable(joint) || !std::isfinite(share)) return;
  Tool& tool = impl_->tools[index];
  tool.join.share = std::clamp(share, 0.0, 1.0);
  tool.join.law.set(joint, tool.join.share);
  tool.join.target = target;
  tool.hand.set_strength(1 - tool.join.share);
}

void World::join_copies(std::size_t index, const RigidState& tool_there, std::span<const CopyTarget> copies,
                        std::span<const Joint> joints, double share) {
  if (!is_finite(tool_there) || !std::isfinite(share)) return;
  Tool& tool = impl_->tools[index];
  // Taken before the old ones are let go, so that a body does not change its owner back and forth.
  const auto before = tool.copies;
  tool.copies.clear();
  tool.copies_share = copies.empty() && share < 1 ? 0 : std::clamp(share, 0.0, 1.0);
  tool.tool_there = tool_there;
  tool.hand.set_strength(1 - tool.copies_share);
  for (std::size_t i = 0; i < std::min({copies.size(), joints.size(), kMostCopies}); ++i) {
    const CopyTarget& copy = copies[i];
    Body* const body = impl_->body_of(copy.body);
    const bool is_usable_copy = body != nullptr && !body->rigid.is_static() && is_finite(copy.state) &&
                                is_finite(copy.p_BJ) && is_usable(joints[i]);
    if (!is_usable_copy || tool.copies_share <= 0) continue;
    impl_->change_owner(*body, [](Body& changed) { ++changed.copies; });
    CopyJoin& join = tool.copies.emplace_back();
    join.body = copy.body.value - 1;
    join.law.set(joints[i], tool.copies_share);
    join.target = copy.state;
    join.p_BJ = copy.p_BJ;
  }
  for (const CopyJoin& old : before) {
    impl_->change_owner(impl_->bodies[old.body], [](Body& changed) { --changed.copies; });
  }
}

void World::join_body(BodyId id, const RigidState& target, const Vec3& p_BJ, const Joint& joint, double share) {
  Body* const body = impl_->body_of(id);
  if (body == nullptr || body->rigid.is_static()) return;
  if (!is_finite(target) || !is_finite(p_BJ) || !is_usable(joint) || !std::isfinite(share)) return;
  impl_->change_owner(*body, [&](Body& changed) {
    changed.join.share = std::clamp(share, 0.0, 1.0);
    changed.join.law.set(joint, changed.join.share);
    changed.join.p_BJ = p_BJ;
    changed.join.target = joined_frame(target, p_BJ);
  });
}

void World::set_body(BodyId id, const RigidState& state) {
  Body* const body = impl_->body_of(id);
  if (body != nullptr && !body->rigid.is_static() && is_finite(state)) body->rigid.set_state(state);
}

void World::set_tool(std::size_t index, const RigidState& state) {
  Tool& tool = impl_->tools[index];
  if (!tool.held && is_finite(state)) tool.rigid.set_state(state);
}

void World::shift_body(BodyId id, const Pose& by_W, const Twist& dv) {
  Body* const body = impl_->body_of(id);
  if (body == nullptr || body->rigid.is_static()) return;
  if (is_finite(by_W) && is_finite(dv)) body->rigid.shift(by_W, dv);
}

void World::shift_tool(std::size_t index, const Pose& by_W, const Twist& dv) {
  Tool& tool = impl_->tools[index];
  if (!tool.held && is_finite(by_W) && is_finite(dv)) tool.rigid.shift(by_W, dv);
}

bool World::is_adopted(BodyId id) const {
  const Body* const body = impl_->body_of(id);
  return body != nullptr && !body->rigid.is_static() && !body->is_free();
}

void World::keep_adopted(BodyId id, double seconds) {
  Body* const body = impl_->body_of(id);
  constexpr double kLongest_s = 3600;
  if (body == nullptr || body->rigid.is_static() || !(seconds >= 0)) return;
  const int steps = impl_->steps_in(std::min(seconds, kLongest_s));
  impl_->change_owner(*body, [steps](Body& changed) {
    changed.kept = steps > 0 ? std::max(changed.kept, steps) : 0;
    if (steps == 0) changed.adopted = 0;
  });
}

void World::set_soft_contact(std::size_t tool, const SoftContact& contact) {
  impl_->tools[tool].soft = contact;
}

TickFaults World::step() noexcept {
  TickFaults faults = impl_->apply_field();
  impl_->damp_and_ramp();
  faults |= impl_->step_touch();
  impl_->free->step(impl_->step_s());
  faults |= impl_->guard_all();
  impl_->adopt();
  faults |= impl_->settle_hands();
  if (impl_->soft) faults |= impl_->step_soft();
  for (Tool& tool : impl_->tools) impl_->end_passing_through(tool);
  ++impl_->steps_done;
  return faults;
}

TouchSummary World::touch(std::size_t index) const {
  const std::size_t thing = impl_->thing_of(impl_->tools[index]);
  const TouchContact& contact = impl_->touch.contact(thing);
  TouchSummary summary{contact.pressing, contact.deepest_m, contact.wrench_W.f.norm(), 0};
  const SoftContact& soft = soft_contact(index);
  if (soft.trust_radius_m > 0) {
    const Tool& tool = impl_->tools[index];
    const Pose X_W = (tool.held ? impl_->bodies[*tool.held].rigid : tool.rigid).state().X;
    summary.soft_force_n = soft_wrench(soft, X_W).f.norm();
  }
  return summary;
}

const SoftContact& World::soft_contact(std::size_t index) const noexcept {
  const Tool& tool = impl_->tools[index];
  return impl_->soft ? impl_->soft->contact(impl_->soft_index_of(impl_->thing_of(tool))) : tool.soft;
}

Vec3 World::pressing_normal_W(std::size_t index, BodyId id) const {
  const Tool& tool = impl_->tools[index];
  if (!tool.touches() || impl_->body_of(id) == nullptr) return Vec3::Zero();
  return impl_->touch.between(impl_->thing_of(tool), id.value - 1).normal_W;
}

std::uint32_t World::hands_on(BodyId id) const {
  const Body* const body = impl_->body_of(id);
  if (body == nullptr || body->rigid.is_static()) return 0;
  return impl_->touch.contact(id.value - 1).hands | impl_->holders_of(id.value - 1);
}

ToolState World::tool(std::size_t index) const {
  const Tool& tool = impl_->tools[index];
  ToolState state;
  state.tool = impl_->tool_state(tool);
  state.wrench_on_hand_W = tool.hand.wrench_on_hand_W();
  if (tool.held) state.held = body_id_at(*tool.held);
  state.energy_into_world_j = tool.hand.energy_into_world_j();
  state.energy_from_world_j = tool.hand.energy_from_world_j();
  state.copies_work_j = tool.hand.copies_work_j();
  return state;
}

std::size_t World::body_count() const {
  return impl_->bodies.size();
}

RigidState World::body(BodyId id) const {
  if (!id.is_valid() || id.value > impl_->bodies.size()) return {};
  return impl_->bodies[id.value - 1].rigid.state();
}

double World::field_energy_kj_per_mol() const {
  return impl_->field.energy_kj_per_mol();
}

double World::mechanical_energy_j() const {
  double energy = 0;
  for (const Body& body : impl_->bodies) {
    if (body.rigid.is_static()) continue;
    energy += body.rigid.mechanical_energy_j(impl_->scene->gravity_m_per_s2);
    if (body.has_anchor()) energy += tandem::stored_energy_j(body.anchor.joint(), body.start().X, body.rigid.state().X);
  }
  for (const Tool& tool : impl_->tools) {
    if (tool.is_free() && tool.has_mass()) energy += tool.rigid.mechanical_energy_j(impl_->scene->gravity_m_per_s2);
  }
  return energy;
}

double World::stored_energy_j(std::uint32_t without_hands) const {
  return mechanical_energy_j() + impl_->coupling_energy_j(without_hands) + impl_->field_energy_j();
}

double World::energy_of_body_j(BodyId id) const {
  const Body* const body = impl_->body_of(id);
  if (body == nullptr || body->rigid.is_static()) return 0;
  double energy = body->rigid.mechanical_energy_j(impl_->scene->gravity_m_per_s2 * (1 - body->join.share));
  if (body->has_anchor())
    energy += tandem::stored_energy_j(body->anchor.joint(), body->start().X, body->rigid.state().X);
  return energy;
}

double World::energy_of_tool_j(std::size_t index) const {
  const Tool& tool = impl_->tools[index];
  if (!tool.is_active || tool.hand.dynamics() == ToolDynamics::kAtHandle) return 0;
  const bool moves = tool.is_free() && tool.has_mass();
  return (moves ? tool.rigid.mechanical_energy_j(Vec3::Zero()) : 0.0) +
         tool.hand.stored_energy_j(impl_->tool_state(tool).X);
}

Wrench World::field_wrench_W(BodyId id) const {
  const Body* const body = impl_->body_of(id);
  if (body == nullptr || body->molecule() == nullptr) return {};
  return impl_->wrenches[id.value - 1];
}

}  // namespace tandem
