// One step of the world: passes bodies and tools to the touch stage and the other solvers, and stores the results.
#include <algorithm>
#include <chrono>
#include <utility>

#include "common/base/processor_time.hpp"
#include "common/physics/world_impl.hpp"

namespace tandem::physics {
namespace {

/// Damping rate of a tool without a handle. Our choice: the tool comes to rest within a quarter of a second, without a
/// jerk.
constexpr double kIdleDamping_per_s = 20;
/// Distance from the origin to which the molecules of absent bodies are moved, so that they exert no force.
constexpr double kOutOfReach_m = 1e6;

}  // namespace

/// Computes the molecular field. If the poses of all molecules are unchanged, the last result is kept.
void World::Impl::find_field() noexcept {
  bool is_found = true;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].molecule() == nullptr) continue;
    Pose X_WB = bodies[i].rigid.pose();
    if (bodies[i].is_absent) X_WB.p.setConstant(kOutOfReach_m * static_cast<double>(i + 1));
    is_found = is_found && is_same(X_WB, poses[i]);
    poses[i] = X_WB;
  }
  if (is_found) return;
  std::ranges::fill(wrenches, Wrench{});
  is_field_limited = field.add_wrenches(poses, wrenches);
}

TickFaults World::Impl::apply_field() noexcept {
  find_field();
  field_energy_kj_per_mol = field.energy_kj_per_mol();
  field_energy_j = field.energy_j();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    // Implicit bodies receive the field in the touch stage (describe_things()).
    if (bodies[i].molecule() != nullptr && bodies[i].is_free()) {
      bodies[i].rigid.apply_wrench(wrenches[i], poses[i].p);
    }
  }
  return is_field_limited ? TickFaults{kFaultFieldLimited} : 0;
}

void World::Impl::ramp_gravity() noexcept {
  if (gravity_steps == 0) return;
  gravity += (gravity_target - gravity) / gravity_steps;
  if (--gravity_steps == 0) gravity = gravity_target;
}

void World::Impl::damp_and_ramp() noexcept {
  ramp_gravity();
  for (WorldBody& body : bodies) {
    if (!body.rigid.is_static()) body.rigid.damp(step_s(), 0);
  }
  for (WorldTool& tool : tools) {
    tool.hand.advance(step_s());
    if (tool.is_free() && !tool.hand.pulls()) tool.rigid.damp(step_s(), kIdleDamping_per_s);
  }
}

/// Describes bodies and tools to the touch stage. External objects are moved by another component. Their weight and
/// molecular forces are passed as well, because the touch stage predicts their motion.
void World::Impl::describe_things() noexcept {
  using Role = TouchThing::Role;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    WorldBody& body = bodies[i];
    TouchThing& thing = things[i];
    thing = {&body.rigid, &body.description->touch, Role::kStatic, body.makes_implicit(), holders_of(i)};
    if (body.is_absent) thing.role = Role::kAbsent;
    if (body.rigid.is_static() || body.is_absent) continue;
    thing.role = body.is_free() ? Role::kExternal : Role::kImplicit;
    thing.wrench_W = body.rigid.weight_W(body.is_free() ? gravity_target : gravity);
    if (body.molecule() == nullptr) continue;
    const Vec3 lever = poses[i].p - body.rigid.centre_W();
    thing.wrench_W += {wrenches[i].f, wrenches[i].t + lever.cross(wrenches[i].f)};
  }
  for (std::size_t i = 0; i < tools.size(); ++i) {
    WorldTool& tool = tools[i];
    const Role role = tool.is_free() ? Role::kImplicit : Role::kAbsent;
    things[bodies.size() + i] = {&tool.rigid, &tool.description->touch, role, true,
                                 bit_of(i),   tool.hand.dynamics(),     {},   tool.passes_through};
    // The tool's dynamics apply to the held body only for a tool at its handle: the motion of the held body is then
    // prescribed. A body held by a massless tool keeps its own mass.
    if (tool.held && tool.hand.dynamics() == haptics::ToolDynamics::kAtHandle)
      things[*tool.held].dynamics = tool.hand.dynamics();
  }
}

void World::Impl::describe_joints() noexcept {
  touch_joints.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    WorldBody& body = bodies[i];
    if (body.has_anchor()) touch_joints.push_back({i, &body.anchor, body.start(), body.rigid.pose()});
  }
}

/// Adds the wrenches of soft bodies, evaluated at the present poses. This explicit step is stable because the stiffness
/// of soft bodies is low.
void World::Impl::add_soft_wrenches() noexcept {
  const auto add = [](TouchThing& thing, const SoftContact& contact) {
    if (thing.role != TouchThing::Role::kImplicit && thing.role != TouchThing::Role::kExternal) return;
    const Pose X_WT = thing.rigid->pose();
    const Wrench wrench = soft_wrench(contact, X_WT);
    const Vec3 lever = X_WT.p - thing.rigid->centre_W();
    thing.wrench_W += {wrench.f, wrench.t + lever.cross(wrench.f)};
    if (thing.role == TouchThing::Role::kExternal) thing.rigid->apply_wrench(wrench, X_WT.p);
  };
  if (soft) {
    for (std::size_t i = 0; i < things.size(); ++i) add(things[i], soft->contact(soft_index_of(i)));
    return;
  }
  for (const WorldTool& tool : tools) {
    if (tool.soft.trust_radius_m > 0) add(things[thing_of(tool)], tool.soft);
  }
}

/// Applies the effects to the tools in `pulls`, i.e. those with a coupling. Effects are not applied to other tools,
/// because a constant force would carry a tool without a coupling away.
void World::Impl::add_effects() noexcept {
  for (std::size_t i = 0; i < tools.size(); ++i) {
    if (!tools[i].hand.pulls()) effects.forget(i);
  }
  effects.apply(static_cast<double>(steps_done) * step_s(), step_s(), things, pulls, touch);
}

TickFaults World::Impl::step_soft() noexcept {
  for (std::size_t i = 0; i < things.size(); ++i) {
    const TouchThing& thing = things[i];
    std::optional<Pose>& X_WT = soft_tools[soft_index_of(i)];
    X_WT.reset();
    if (thing.role != TouchThing::Role::kAbsent) X_WT = thing.rigid->pose();
  }
  return soft->advance(soft_tools);
}

void World::Impl::describe_pulls() noexcept {
  pulls.clear();
  for (std::size_t i = 0; i < tools.size(); ++i) {
    WorldTool& tool = tools[i];
    tool.pull.reset();
    if (!tool.is_active || !tool.hand.pulls()) continue;
    tool.pull = pulls.size();
    pulls.push_back({i, thing_of(tool), &tool.hand, tool_state(tool).X, {}});
  }
}

TickFaults World::Impl::step_touch() noexcept {
  describe_things();
  add_soft_wrenches();
  describe_joints();
  describe_pulls();
  if (!effects.is_empty()) add_effects();
  return touch.step(step_s(), things, pulls, touch_joints);
}

/// Updates which bodies belong to the touch stage in the next step: those that a tool touches, directly or through
/// other bodies. A body that no tool has touched for kAdoption_s becomes free again.
void World::Impl::adopt() noexcept {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    WorldBody& body = bodies[i];
    if (body.rigid.is_static() || body.hands > 0) continue;
    change_owner(body, [&](WorldBody& changed) {
      changed.adopted = touch.contact(i).is_reached ? adoption_steps() : std::max(0, changed.adopted - 1);
      changed.kept = std::max(0, changed.kept - 1);
    });
  }
}

TickFaults World::Impl::settle_hands() noexcept {
  TickFaults faults = 0;
  for (WorldTool& tool : tools) {
    if (!tool.is_active || !tool.pull) continue;
    tool.hand.settle(pulls[*tool.pull].X_WT, tool_state(tool), pulls[*tool.pull].wrench_W);
    if (tool.hand.is_saturated()) faults |= kFaultCouplingSaturated;
  }
  return faults;
}

/// Keeps waiting bodies at their start poses, against weight and field, until a tool first takes or touches them.
void World::Impl::keep_waiting() noexcept {
  for (WorldBody& body : bodies) {
    body.waits = body.waits && body.is_free();
    if (body.waits) body.rigid.set_state(body.start());
  }
}

TickFaults World::Impl::limit_speed(RigidBody& rigid) noexcept {
  return rigid.limit_speed(scene->limits.body_speed_m_per_s, step_s()) ? TickFaults{kFaultSpeedLimited} : 0;
}

TickFaults World::Impl::limit_or_restore(std::size_t index) noexcept {
  WorldBody& body = bodies[index];
  if (body.is_absent) return 0;
  const bool is_finite = body.rigid.is_finite();
  const bool is_outside = is_finite && body.hands == 0 && body.rigid.pose().p.norm() > scene->limits.bounds_m;
  const bool is_requested = puts_all_back && body.hands == 0;
  if (is_finite && !is_outside && !is_requested) return limit_speed(body.rigid);
  returned_bodies.push_back(body_id_at(index));
  // The body is removed and added again to clear its contacts, which may contain values that are not finite.
  if (body.is_free()) free->remove(index);
  body.rigid.set_state(body.start());
  if (body.is_free()) free->add(index, body.rigid);
  if (is_outside) return TickFaults{kFaultOutOfBounds};
  return is_finite ? TickFaults{0} : TickFaults{kFaultNotFinite};
}

TickFaults World::Impl::limit_or_restore_all(bool are_free) noexcept {
  TickFaults faults = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const WorldBody& body = bodies[i];
    if (!body.rigid.is_static() && !body.is_absent && body.is_free() == are_free) faults |= limit_or_restore(i);
  }
  if (are_free) return faults;
  for (WorldTool& tool : tools) {
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

void World::Impl::end_passing_through(WorldTool& tool) noexcept {
  if (!tool.passes_through || !tool.is_active) return;
  const WorldBody& body = bodies[*tool.passes_through];
  const Pose X_WT = tool.rigid.pose(), X_WB = body.rigid.pose();
  if (!overlaps(tool.description->touch, X_WT, body.description->touch, X_WB, 0)) tool.passes_through.reset();
}

TickFaults World::step() noexcept {
  const TickFaults faults = answer();
  return faults | finish();
}

/// If there are soft bodies, answer() executes the whole step, because the users feel soft bodies, too.
TickFaults World::answer() noexcept {
  TickFaults faults = finish();
  faults |= impl_->apply_field();
  impl_->damp_and_ramp();
  faults |= impl_->step_touch();
  impl_->returned_bodies.clear();
  faults |= impl_->limit_or_restore_all(false);
  faults |= impl_->settle_hands();
  impl_->is_answered = true;
  return impl_->soft ? faults | finish() : faults;
}

TickFaults World::finish() noexcept {
  if (!std::exchange(impl_->is_answered, false)) return 0;
  TickFaults faults = impl_->free->step(impl_->step_s());
  impl_->keep_waiting();
  faults |= impl_->limit_or_restore_all(true);
  impl_->puts_all_back = false;
  impl_->adopt();
  if (impl_->soft) faults |= impl_->step_soft();
  for (WorldTool& tool : impl_->tools) impl_->end_passing_through(tool);
  ++impl_->steps_done;
  return faults;
}

void World::look_ahead() noexcept {
  impl_->find_field();
  impl_->describe_things();
  impl_->touch.look_ahead(impl_->step_s(), impl_->things);
}

Duration World::quickest_step() noexcept {
  constexpr int kSteps = 10;
  Duration quickest = std::chrono::hours(1);
  for (int i = 0; i < kSteps; ++i) {
    // Poses that are NaN differ from every pose. They force an evaluation of the molecular field in each step, which is
    // otherwise skipped for unchanged poses.
    for (Pose& X_WB : impl_->poses) X_WB = kNowhere;
    const Duration begin = processor_time();
    step();
    quickest = std::min(quickest, processor_time() - begin);
  }
  return quickest;
}

}  // namespace tandem::physics
