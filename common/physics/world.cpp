// Construction of the world from its description, access to its state, and external corrections of that state.
#include "common/physics/world.hpp"

#include <algorithm>
#include <cmath>

#include "common/physics/world_impl.hpp"

namespace tandem::physics {
namespace {

/// Radius assumed for an object without shapes. It limits the rotational speed of the object.
constexpr double kRadiusOfNone_m = 0.01;

/// Returns the radius of the bounding sphere about the centre of mass.
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

}  // namespace

World::Impl::Impl(std::shared_ptr<const WorldDescription> world, std::unique_ptr<FreeBodies> free_bodies,
                  std::unique_ptr<SoftBodies> soft_bodies)
    : scene(std::move(world)),
      gravity(scene->gravity_m_per_s2),
      gravity_target(gravity),
      coupling(scene->coupling),
      field(*scene),
      touch(touch_limits(*scene, scene->tools)),
      soft(std::move(soft_bodies)),
      effects(scene->effects, scene->bodies.size() + scene->tools.size(), scene->tools.size()),
      free(std::move(free_bodies)) {
  for (const BodyDescription& body : scene->bodies) {
    bodies.push_back({make_body(body), &body});
    if (body.anchor) bodies.back().anchor.set(*body.anchor);
  }
  for (const ToolDescription& tool : scene->tools) {
    tools.push_back({make_tool(tool), &tool, ToolHand(coupling.law, coupling.parameters)});
    if (tool.holds_body) bodies[*tool.holds_body].waits = true;
  }
  things.resize(bodies.size() + tools.size());
  pulls.reserve(tools.size());
  touch_joints.reserve(bodies.size());
  soft_tools.resize(things.size());
  returned_bodies.reserve(bodies.size());
  poses.resize(bodies.size(), kNowhere);
  wrenches.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) free->add(i, bodies[i].rigid);
}

RigidState World::Impl::tool_state(const WorldTool& tool) const {
  if (!tool.held) return tool.rigid.state();
  const RigidBody& body = bodies[*tool.held].rigid;
  const RigidState of_body = body.state();
  const Pose X_WT = of_body.X * tool.X_BT;
  return {X_WT, {body.velocity_at_W(X_WT.p), of_body.V.w}};
}

WorldBody* World::Impl::body_of(BodyId id) {
  return id.is_valid() && id.value <= bodies.size() ? &bodies[id.value - 1] : nullptr;
}

std::size_t World::Impl::thing_of(const WorldTool& tool) const {
  return tool.held ? *tool.held : bodies.size() + static_cast<std::size_t>(&tool - tools.data());
}

std::uint32_t World::Impl::holders_of(std::size_t body) const {
  std::uint32_t holders = 0;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    if (tools[i].held == body) holders |= bit_of(i);
  }
  return holders;
}

/// Returns the index of a thing in the arrays of the soft bodies, which list the tools first and then the bodies.
std::size_t World::Impl::soft_index_of(std::size_t thing) const {
  return thing < bodies.size() ? tools.size() + thing : thing - bodies.size();
}

World::World(std::shared_ptr<const WorldDescription> description, std::unique_ptr<FreeBodies> free_bodies,
             std::unique_ptr<SoftBodies> soft_bodies)
    : impl_(std::make_unique<Impl>(std::move(description), std::move(free_bodies), std::move(soft_bodies))) {}
World::~World() = default;
World& World::operator=(World&& other) noexcept = default;

void World::set_body(BodyId id, const RigidState& state) {
  WorldBody* const body = impl_->body_of(id);
  if (body == nullptr || body->rigid.is_static() || !is_finite(state)) return;
  impl_->change_owner(*body, [&state](WorldBody& changed) {
    changed.waits = changed.is_absent = false;
    changed.rigid.set_state(state);
  });
}

void World::remove_body(BodyId id) {
  WorldBody* const body = impl_->body_of(id);
  if (body == nullptr) return;
  const auto index = static_cast<std::size_t>(body - impl_->bodies.data());
  for (std::size_t i = 0; i < impl_->tools.size(); ++i) {
    if (impl_->tools[i].held == index) release(i);
  }
  impl_->change_owner(*body, [](WorldBody& changed) {
    changed.is_absent = true;
    changed.adopted = changed.kept = 0;
  });
}

void World::restore_body(BodyId id) {
  WorldBody* const body = impl_->body_of(id);
  if (body != nullptr) impl_->change_owner(*body, [](WorldBody& changed) { changed.is_absent = false; });
}

bool World::is_absent(BodyId id) const {
  const WorldBody* const body = impl_->body_of(id);
  return body != nullptr && body->is_absent;
}

void World::set_gravity(const Vec3& m_per_s2) {
  if (!m_per_s2.allFinite() || m_per_s2 == impl_->gravity_target) return;
  impl_->gravity_target = m_per_s2;
  impl_->gravity_steps = impl_->steps_in(kGravityRamp_s);
  impl_->free->set_gravity(m_per_s2);
}

void World::jump_gravity(const Vec3& m_per_s2) {
  if (!m_per_s2.allFinite()) return;
  impl_->gravity = impl_->gravity_target = m_per_s2;
  impl_->gravity_steps = 0;
  impl_->free->set_gravity(m_per_s2);
}

Vec3 World::gravity() const {
  return impl_->gravity;
}

std::span<const BodyId> World::returned_bodies() const noexcept {
  return impl_->returned_bodies;
}

void World::return_all() noexcept {
  for (std::size_t i = 0; i < impl_->tools.size(); ++i) {
    if (impl_->tools[i].held != impl_->scene->tools[i].holds_body) release(i);
  }
  impl_->puts_all_back = true;
}

std::span<const Vec3> World::soft_nodes_W(std::size_t soft_body) const {
  return impl_->soft == nullptr ? std::span<const Vec3>() : impl_->soft->nodes_W(soft_body);
}
void World::set_soft_nodes(std::size_t soft_body, std::span<const Vec3> nodes_W) {
  impl_->soft->set_nodes(soft_body, nodes_W);
}

void World::set_tool(std::size_t index, const RigidState& state) {
  WorldTool& tool = impl_->tools[index];
  if (!tool.held && is_finite(state)) tool.rigid.set_state(state);
}

void World::shift_body(BodyId id, const Pose& by_W, const Twist& dv) {
  WorldBody* const body = impl_->body_of(id);
  if (body == nullptr || body->rigid.is_static()) return;
  if (is_finite(by_W) && is_finite(dv)) body->rigid.shift(by_W, dv);
}

void World::shift_tool(std::size_t index, const Pose& by_W, const Twist& dv) {
  WorldTool& tool = impl_->tools[index];
  if (!tool.held && is_finite(by_W) && is_finite(dv)) tool.rigid.shift(by_W, dv);
}

void World::keep_implicit(BodyId id, double seconds) {
  WorldBody* const body = impl_->body_of(id);
  constexpr double kLongest_s = 3600;
  if (body == nullptr || body->rigid.is_static() || !(seconds >= 0)) return;
  const int steps = impl_->steps_in(std::min(seconds, kLongest_s));
  impl_->change_owner(*body, [steps](WorldBody& changed) {
    changed.kept = steps > 0 ? std::max(changed.kept, steps) : 0;
    if (steps == 0) changed.adopted = 0;
  });
}

std::size_t World::contact_points_W(std::size_t index, std::span<Vec3> out) const noexcept {
  const WorldTool& tool = impl_->tools[index];
  return tool.is_active ? impl_->touch.pressed_points_W(impl_->thing_of(tool), out) : 0;
}

void World::set_soft_contact(std::size_t tool, const SoftContact& contact) {
  impl_->tools[tool].soft = contact;
}

TouchSummary World::touch(std::size_t index) const {
  const std::size_t thing = impl_->thing_of(impl_->tools[index]);
  const TouchContact& contact = impl_->touch.contact(thing);
  TouchSummary summary{contact.pressing, contact.deepest_m, contact.wrench_W.f.norm(), 0};
  const SoftContact& soft = soft_contact(index);
  if (soft.trust_radius_m > 0) {
    const WorldTool& tool = impl_->tools[index];
    const Pose X_W = (tool.held ? impl_->bodies[*tool.held].rigid : tool.rigid).pose();
    summary.soft_force_n = soft_wrench(soft, X_W).f.norm();
  }
  return summary;
}

const SoftContact& World::soft_contact(std::size_t index) const noexcept {
  const WorldTool& tool = impl_->tools[index];
  return impl_->soft ? impl_->soft->contact(impl_->soft_index_of(impl_->thing_of(tool))) : tool.soft;
}

Vec3 World::pressing_normal_W(std::size_t index, BodyId id) const {
  const WorldTool& tool = impl_->tools[index];
  if (!tool.is_free() || impl_->body_of(id) == nullptr) return Vec3::Zero();
  return impl_->touch.between(impl_->thing_of(tool), id.value - 1).normal_W;
}

std::uint32_t World::hands_on(BodyId id) const {
  const WorldBody* const body = impl_->body_of(id);
  if (body == nullptr || body->rigid.is_static()) return 0;
  return impl_->touch.contact(id.value - 1).hands | impl_->holders_of(id.value - 1);
}

ToolState World::tool(std::size_t index) const {
  const WorldTool& tool = impl_->tools[index];
  ToolState state;
  state.tool = impl_->tool_state(tool);
  state.wrench_on_hand_W = tool.hand.wrench_on_hand_W();
  state.has_handle = tool.hand.has_handle();
  if (tool.hand.has_handle()) {
    state.handle = tool.hand.target();
    const Vec3 d_W = state.tool.X.p - tool.hand.target_pose().p;
    state.pull_on_tool_W = haptics::reaction_on_hand(state.wrench_on_hand_W, d_W);
  }
  if (tool.held) state.held = body_id_at(*tool.held);
  state.energy_into_world_j = tool.hand.energy_into_world_j();
  state.energy_from_world_j = tool.hand.energy_from_world_j();
  return state;
}

RigidState World::body(BodyId id) const {
  if (!id.is_valid() || id.value > impl_->bodies.size()) return {};
  const WorldBody& body = impl_->bodies[id.value - 1];
  if (!impl_->is_answered || !body.is_free() || body.rigid.is_static()) return body.rigid.state();
  RigidBody after = body.rigid;
  after.advance(after.velocity_of_centre_W(), impl_->step_s());
  return after.state();
}

double World::field_energy_kj_per_mol() const {
  return impl_->field_energy_kj_per_mol;
}

double World::field_energy_j() const {
  return impl_->field_energy_j;
}

}  // namespace tandem::physics
