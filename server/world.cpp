#include "server/world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "server/bullet_world.hpp"
#include "server/effect_stage.hpp"
#include "server/molecular_forces.hpp"
#include "server/soft_scene.hpp"
#include "server/soft_world.hpp"
#include "server/tool_hand.hpp"
#include "server/touch_stage.hpp"

namespace tandem {
namespace {

/// How fast a tool without a handle comes to rest. Ours: gone in a quarter of a second, without a jerk.
constexpr double kIdleDamping_per_s = 20;

/// A tool let go this deep in a body, or less, was pressing on it and goes on doing so; deeper, it was inside.
constexpr double kPressedDepth_m = 2e-4;

Vec3 gravity_of(const wire::Scene& scene) {
  return {scene.gravity_m_per_s2(0), scene.gravity_m_per_s2(1), scene.gravity_m_per_s2(2)};
}

RigidBody make_body(const wire::Body& description, const LoadedBody& loaded) {
  auto shape =
      std::make_unique<CollisionShape>(description.shapes(), loaded.shapes, loaded.mass.X_BC, loaded.mass.mass_kg <= 0);
  const BodyTraits traits{description.friction(), description.restitution(), description.linear_damping_per_s(),
                          description.angular_damping_per_s(), description.gravity()};
  return {std::move(shape), loaded.mass, traits, loaded.X_WB};
}

RigidBody make_tool(const wire::Tool& description, const LoadedTool& loaded) {
  auto shape = std::make_unique<CollisionShape>(description.shapes(), loaded.shapes, loaded.mass.X_BC, false);
  const BodyTraits traits{description.friction(), 0, 0, 0, false};
  return {std::move(shape), loaded.mass, traits, loaded.X_WT};
}

struct Body {
  RigidBody rigid;
  const TouchModel* touch = nullptr;
  RigidState start;
  const Molecule* molecule = nullptr;
  bool is_graspable = false;
  int hands = 0;    ///< tools that hold it
  int adopted = 0;  ///< steps that the touch stage still steps it for, after something led has touched it

  bool is_in_bullet() const { return hands == 0 && adopted == 0; }
};

/// A body that tools touch belongs to the touch stage, and for so long after: taps and slides do not change its owner
/// at every bounce.
constexpr double kAdoption_s = 0.25;

struct Tool {
  RigidBody rigid;
  const TouchModel* touch = nullptr;
  ToolHand hand;
  RigidState start;
  bool is_active = false;
  std::optional<std::size_t> held;            ///< index of a body
  Pose X_BT;                                  ///< its place on the held body
  std::optional<std::size_t> passes_through;  ///< body that was released with the tool inside

  bool is_free() const { return is_active && !held; }
  bool has_mass() const { return hand.dynamics() == ToolDynamics::kWithMass; }
};

TouchStage::Limits touch_limits(const LoadedScene& scene) {
  const wire::Limits& limits = scene.description.limits();
  return {scene.bodies.size() + scene.tools.size(),
          scene.tools.size(),
          limits.contact_pairs(),
          {limits.contact_points()},
          limits.body_speed_m_per_s()};
}

}  // namespace

// Order of members: Bullet's world is destroyed before the bodies that it refers to.
struct World::Impl {
  Impl(std::shared_ptr<const LoadedScene> loaded, SoftStepping soft_stepping);

  double step_s() const { return 1.0 / scene->description.step_rate_hz(); }
  RigidState tool_state(const Tool& tool) const;
  void attach(Tool& tool, std::size_t body, const Pose& X_BT);
  void detach(Tool& tool);
  double distance_m(const Tool& tool, std::size_t body, double limit_m) const;
  CouplingParameters coupling_of(const Tool& tool) const;

  TickFaults apply_field() noexcept;
  void damp_and_ramp() noexcept;
  void describe_things() noexcept;
  void add_soft_wrenches() noexcept;
  void add_effects() noexcept;
  TickFaults step_soft() noexcept;
  std::size_t soft_index_of(std::size_t thing) const;
  TickFaults step_touch() noexcept;
  void adopt() noexcept;
  int adoption_steps() const { return static_cast<int>(std::ceil(kAdoption_s / step_s())); }
  TickFaults settle_hands() noexcept;
  TickFaults guard(RigidBody& rigid, const RigidState& start, bool is_in_bullet) noexcept;
  TickFaults guard_all() noexcept;
  void end_passing_through(Tool& tool) noexcept;
  std::size_t thing_of(const Tool& tool) const;

  std::shared_ptr<const LoadedScene> scene;
  Vec3 gravity;
  CouplingParameters coupling;
  std::vector<Body> bodies;
  std::vector<Tool> tools;
  MolecularForces field;
  std::vector<Pose> poses;         ///< scratch of apply_field()
  std::vector<Wrench> wrenches;    ///< likewise
  std::vector<TouchThing> things;  ///< bodies, then tools
  std::vector<TouchPull> pulls;
  std::vector<std::size_t> pulling;  ///< tool of pulls[i]
  std::vector<SoftTool> soft_tools;  ///< tools, then bodies
  TouchStage touch;
  std::unique_ptr<SoftWorld> soft;  ///< null without soft bodies
  EffectStage effects;
  std::vector<EffectTool> effect_tools;  ///< scratch of add_effects()
  std::uint64_t steps_done = 0;
  BulletWorld bullet;
};

World::Impl::Impl(std::shared_ptr<const LoadedScene> loaded, SoftStepping soft_stepping)
    : scene(std::move(loaded)),
      gravity(gravity_of(scene->description)),
      coupling(scene->coupling.parameters),
      field(*scene),
      touch(touch_limits(*scene)),
      effects(scene->effects, scene->bodies.size() + scene->tools.size(), scene->tools.size()),
      bullet(gravity) {
  const wire::Scene& description = scene->description;
  for (int i = 0; i < description.bodies_size(); ++i) {
    const LoadedBody& body = scene->bodies[static_cast<std::size_t>(i)];
    bodies.push_back({make_body(description.bodies(i), body),
                      &body.touch,
                      {body.X_WB, Twist{}},
                      body.molecule.get(),
                      description.bodies(i).graspable() && body.mass.mass_kg > 0});
  }
  for (int i = 0; i < description.tools_size(); ++i) {
    const LoadedTool& tool = scene->tools[static_cast<std::size_t>(i)];
    tools.push_back({make_tool(description.tools(i), tool),
                     &tool.touch,
                     ToolHand(description.coupling().law(), coupling),
                     {tool.X_WT, Twist{}},
                     false,
                     {},
                     {},
                     {}});
  }
  things.resize(bodies.size() + tools.size());
  pulls.reserve(tools.size());
  pulling.reserve(tools.size());
  effect_tools.reserve(tools.size());
  soft_tools.resize(things.size());
  if (!scene->soft_bodies.empty()) {
    const bool is_inline = soft_stepping == SoftStepping::kInline;
    soft = std::make_unique<SoftWorld>(soft_world_settings(*scene),
                                       is_inline ? SoftWorld::Execution::kInline : SoftWorld::Execution::kWorker);
  }
  poses.resize(bodies.size());
  wrenches.resize(bodies.size());
  for (Body& body : bodies) bullet.add(body.rigid);
}

RigidState World::Impl::tool_state(const Tool& tool) const {
  if (!tool.held) return tool.rigid.state();
  const RigidBody& body = bodies[*tool.held].rigid;
  const RigidState of_body = body.state();
  const Pose X_WT = of_body.X * tool.X_BT;
  return {X_WT, {body.velocity_at_W(X_WT.p), of_body.V.w}};
}

void World::Impl::attach(Tool& tool, std::size_t index, const Pose& X_BT) {
  Body& body = bodies[index];
  if (body.is_in_bullet()) bullet.remove(body.rigid);
  ++body.hands;
  tool.passes_through.reset();
  tool.held = index;
  tool.X_BT = X_BT;
  tool.hand.set_coupling(coupling_of(tool));
}

void World::Impl::detach(Tool& tool) {
  tool.rigid.set_state(tool_state(tool));
  Body& body = bodies[*tool.held];
  // It goes back to Bullet when no tool has touched it for a while (adopt()).
  --body.hands;
  body.adopted = adoption_steps();
  const Pose X_WT = tool.rigid.state().X, X_WB = body.rigid.state().X;
  if (overlaps(*tool.touch, X_WT, *body.touch, X_WB, kPressedDepth_m)) tool.passes_through = tool.held;
  tool.held.reset();
  tool.hand.set_coupling(coupling_of(tool));
}

CouplingParameters World::Impl::coupling_of(const Tool& tool) const {
  const auto index = static_cast<std::size_t>(&tool - tools.data());
  return coupling_in_force(scene->coupling, coupling, moved_mass(*scene, index, tool.held));
}

/// To the body's surface; of a molecule, from the tool's origin to the nearest atom.
double World::Impl::distance_m(const Tool& tool, std::size_t index, double limit_m) const {
  const Body& body = bodies[index];
  const Pose X_WT = tool.rigid.state().X;
  const Pose X_WB = body.rigid.state().X;
  if (body.molecule == nullptr) return tandem::distance_m(*tool.touch, X_WT, *body.touch, X_WB, limit_m);
  const double scale = scene->description.molecular_field().metres_per_angstrom();
  const Vec3 tool_B = X_WB.inverse() * X_WT.p;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vec3& atom : body.molecule->positions_angstrom) {
    nearest = std::min(nearest, (scale * atom - tool_B).norm());
  }
  return nearest;
}

std::size_t World::Impl::thing_of(const Tool& tool) const {
  return tool.held ? *tool.held : bodies.size() + static_cast<std::size_t>(&tool - tools.data());
}

TickFaults World::Impl::apply_field() noexcept {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].molecule == nullptr) continue;
    poses[i] = bodies[i].rigid.state().X;
    wrenches[i] = Wrench{};
  }
  const bool is_limited = field.add_wrenches(poses, wrenches);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    // Held ones feel it in the touch stage (describe_things()).
    if (bodies[i].molecule != nullptr && bodies[i].is_in_bullet())
      bodies[i].rigid.apply_wrench(wrenches[i], poses[i].p);
  }
  return is_limited ? TickFaults{kFaultFieldLimited} : 0;
}

void World::Impl::damp_and_ramp() noexcept {
  for (Body& body : bodies) {
    if (!body.rigid.is_static()) body.rigid.damp(step_s(), 0);
  }
  for (Tool& tool : tools) {
    tool.hand.advance(step_s());
    if (tool.is_free() && !tool.hand.pulls()) tool.rigid.damp(step_s(), kIdleDamping_per_s);
  }
}

/// Guests' weight and field are told as well, so that the stage foresees how they move.
void World::Impl::describe_things() noexcept {
  using Role = TouchThing::Role;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Body& body = bodies[i];
    TouchThing& thing = things[i];
    thing = {&body.rigid, body.touch, Role::kStatic, body.hands > 0, ToolDynamics::kWithMass, {}, {}};
    if (body.rigid.is_static()) continue;
    thing.role = body.is_in_bullet() ? Role::kGuest : Role::kOurs;
    thing.wrench_W = body.rigid.weight_W(gravity);
    if (body.molecule == nullptr) continue;
    const Vec3 lever = poses[i].p - body.rigid.centre_W();
    thing.wrench_W += {wrenches[i].f, wrenches[i].t + lever.cross(wrenches[i].f)};
  }
  for (std::size_t i = 0; i < tools.size(); ++i) {
    Tool& tool = tools[i];
    const Role role = tool.is_free() ? Role::kOurs : Role::kAbsent;
    things[bodies.size() + i] = {&tool.rigid, tool.touch, role, true, tool.hand.dynamics(), {}, tool.passes_through};
    // A body keeps its mass in a massless tool, but not its freedom in one that is at the handle.
    if (tool.held && tool.hand.dynamics() == ToolDynamics::kAtHandle)
      things[*tool.held].dynamics = tool.hand.dynamics();
  }
}

/// Soft bodies list tools first.
std::size_t World::Impl::soft_index_of(std::size_t thing) const {
  return thing < bodies.size() ? tools.size() + thing : thing - bodies.size();
}

/// Evaluated where the things are now: soft bodies are soft enough for that to be stable.
void World::Impl::add_soft_wrenches() noexcept {
  for (std::size_t i = 0; i < things.size(); ++i) {
    TouchThing& thing = things[i];
    if (thing.role != TouchThing::Role::kOurs && thing.role != TouchThing::Role::kGuest) continue;
    const Pose X_WT = thing.rigid->state().X;
    const Wrench wrench = soft_wrench(soft->contact(soft_index_of(i)), X_WT);
    const Vec3 lever = X_WT.p - thing.rigid->centre_W();
    thing.wrench_W += {wrench.f, wrench.t + lever.cross(wrench.f)};
    if (thing.role == TouchThing::Role::kGuest) thing.rigid->apply_wrench(wrench, X_WT.p);
  }
}

/// On tools that a hand moves: one that floats would be blown away. `pulls` are those of this step.
void World::Impl::add_effects() noexcept {
  effect_tools.clear();
  for (std::size_t i = 0; i < pulls.size(); ++i) {
    const TouchPull& pull = pulls[i];
    const bool is_massless = things[pull.thing].dynamics == ToolDynamics::kMassless;
    effect_tools.push_back(
        {pulling[i], pull.thing, pull.X_WT, is_massless ? pull.hand->tether(pull.X_WT) : CouplingTether{}});
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
  if (soft) add_soft_wrenches();
  pulls.clear();
  pulling.clear();
  for (std::size_t i = 0; i < tools.size(); ++i) {
    if (!tools[i].is_active || !tools[i].hand.pulls()) continue;
    pulls.push_back({thing_of(tools[i]), &tools[i].hand, tool_state(tools[i]).X, {}});
    pulling.push_back(i);
  }
  if (!effects.is_empty()) add_effects();
  return touch.step(step_s(), things, pulls);
}

/// What a tool touches, directly or through other bodies, is the touch stage's from the next step on, with all that it
/// leans on; when it has not been touched for a while, it is Bullet's again.
void World::Impl::adopt() noexcept {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Body& body = bodies[i];
    if (body.rigid.is_static() || body.hands > 0) continue;
    const bool was_in_bullet = body.is_in_bullet();
    body.adopted = touch.contact(i).is_reached ? adoption_steps() : std::max(0, body.adopted - 1);
    if (was_in_bullet && !body.is_in_bullet()) bullet.remove(body.rigid);
    if (!was_in_bullet && body.is_in_bullet()) bullet.add(body.rigid);
  }
}

TickFaults World::Impl::settle_hands() noexcept {
  TickFaults faults = 0;
  for (std::size_t i = 0; i < pulls.size(); ++i) {
    Tool& tool = tools[pulling[i]];
    tool.hand.settle(pulls[i].X_WT, tool_state(tool), pulls[i].wrench_W);
    if (tool.hand.is_saturated()) faults |= kFaultCouplingSaturated;
  }
  return faults;
}

TickFaults World::Impl::guard(RigidBody& rigid, const RigidState& start, bool is_in_bullet) noexcept {
  if (!rigid.is_finite()) {
    // Out and in again, so that no contact keeps a number that is not finite.
    if (is_in_bullet) bullet.remove(rigid);
    rigid.set_state(start);
    if (is_in_bullet) bullet.add(rigid);
    return kFaultNotFinite;
  }
  const double limit = scene->description.limits().body_speed_m_per_s();
  return rigid.limit_speed(limit, step_s()) ? TickFaults{kFaultSpeedLimited} : 0;
}

TickFaults World::Impl::guard_all() noexcept {
  TickFaults faults = 0;
  for (Body& body : bodies) {
    if (!body.rigid.is_static()) faults |= guard(body.rigid, body.start, body.is_in_bullet());
  }
  for (Tool& tool : tools) {
    if (tool.is_free()) faults |= guard(tool.rigid, tool.start, false);
  }
  return faults;
}

void World::Impl::end_passing_through(Tool& tool) noexcept {
  if (!tool.passes_through || !tool.is_active) return;
  const Body& body = bodies[*tool.passes_through];
  if (!overlaps(*tool.touch, tool.rigid.state().X, *body.touch, body.rigid.state().X, 0)) tool.passes_through.reset();
}

World::World(std::shared_ptr<const LoadedScene> scene, SoftStepping soft_stepping)
    : impl_(std::make_unique<Impl>(std::move(scene), soft_stepping)) {}
World::~World() = default;

void World::activate_tool(std::size_t index) {
  Tool& tool = impl_->tools[index];
  if (tool.is_active) return;
  tool.is_active = true;
  tool.rigid.set_state(tool.start);
  const std::optional<std::size_t> held = impl_->scene->tools[index].holds_body;
  if (!held) return tool.hand.reset(impl_->coupling_of(tool));
  Body& body = impl_->bodies[*held];
  if (body.hands == 0) body.rigid.set_state(body.start);
  impl_->attach(tool, *held, body.start.X.inverse() * tool.start.X);
  tool.hand.reset(impl_->coupling_of(tool));
  tool.hand.anchor_at(impl_->tool_state(tool).X);
}

void World::deactivate_tool(std::size_t index) {
  Tool& tool = impl_->tools[index];
  if (!tool.is_active) return;
  release(index);
  tool.passes_through.reset();
  tool.hand.let_go();
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
  if (id.is_valid() && !impl_->bodies[id.value - 1].is_graspable) return GrabResult::kNotGraspable;

  double nearest_m = impl_->scene->description.limits().grab_reach_m();
  std::optional<std::size_t> nearest;
  for (std::size_t i = 0; i < impl_->bodies.size(); ++i) {
    if (!impl_->bodies[i].is_graspable || (id.is_valid() && i + 1 != id.value)) continue;
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

TickFaults World::step() noexcept {
  TickFaults faults = impl_->apply_field();
  impl_->damp_and_ramp();
  faults |= impl_->step_touch();
  impl_->bullet.step(impl_->step_s());
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
  if (impl_->soft) {
    const Tool& tool = impl_->tools[index];
    const Pose X_W = (tool.held ? impl_->bodies[*tool.held].rigid : tool.rigid).state().X;
    summary.soft_force_n = soft_wrench(impl_->soft->contact(impl_->soft_index_of(thing)), X_W).f.norm();
  }
  return summary;
}

ToolState World::tool(std::size_t index) const {
  const Tool& tool = impl_->tools[index];
  ToolState state;
  state.tool = impl_->tool_state(tool);
  state.wrench_on_hand_W = tool.hand.wrench_on_hand_W();
  if (tool.held) state.held = body_id_at(*tool.held);
  state.energy_into_world_j = tool.hand.energy_into_world_j();
  state.energy_from_world_j = tool.hand.energy_from_world_j();
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
    if (!body.rigid.is_static()) energy += body.rigid.mechanical_energy_j(impl_->gravity);
  }
  for (const Tool& tool : impl_->tools) {
    if (tool.is_free() && tool.has_mass()) energy += tool.rigid.mechanical_energy_j(impl_->gravity);
  }
  return energy;
}

}  // namespace tandem
