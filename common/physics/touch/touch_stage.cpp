// One step of the touch stage:
// 1. It predicts how far each object moves (its reach), and finds the close pairs and their contacts.
// 2. It solves for all contacts and couplings together.
// 3. It writes the results to the objects and couplings.
#include "common/physics/touch/touch_stage.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::physics {
namespace {

/// Capacity of the solver: number of contact points of all pairs in a step.
constexpr std::size_t kMaxRows = 65536;

/// Constants of look_ahead(): the reach of an object in the next step is predicted as kLikelyReach times its last
/// reach, plus the displacement by an acceleration of kLikelyPush_m_per_s2. If the object moves farther, its contacts
/// are searched again in the step.
constexpr double kLikelyReach = 1.25, kLikelyPush_m_per_s2 = 10;

/// Returns the wrench of a coupling law on `rigid` in its present state, about the centre of mass. The law acts on the
/// frame X_WT of the body.
Wrench about_centre_W(const contact::SolverCoupling& coupling, const RigidBody& rigid) {
  const Pose& X_WT = coupling.X_WT;
  const Twist V_WT{rigid.velocity_at_W(X_WT.p), rigid.velocity_of_centre_W().w};
  const haptics::CouplingState state = haptics::coupling_state(coupling.X_WH, coupling.V_WH, X_WT, V_WT);
  const Wrench on_tool = coupling.law->wrench_on_tool_W(state);
  return {on_tool.f, on_tool.t + (X_WT.p - rigid.centre_W()).cross(on_tool.f)};
}

bool may_move(const TouchThing& thing) {
  return thing.role == TouchThing::Role::kImplicit || thing.role == TouchThing::Role::kExternal;
}

/// Returns the pose of a shape.
Pose pose_of(std::span<const TouchThing> things, std::size_t thing, std::size_t part) {
  return things[thing].rigid->pose() * things[thing].model->parts[part].X_BS;
}

/// Returns the sum of the contact normals, each weighted by depth times area. The elastic force of a contact is
/// proportional to this weight, up to the rigid depth.
Vec3 normal_of(std::span<const contact::ContactPoint> contacts) {
  Vec3 sum_W = Vec3::Zero();
  for (const contact::ContactPoint& contact : contacts) {
    sum_W += std::max(0.0, contact.depth_m) * contact.area_m2 * contact.normal_W;
  }
  return sum_W;
}

void gain(double step_s, const Wrench& wrench_W, const RigidBody& rigid, Twist& gained) {
  const Twist a = rigid.acceleration_W(wrench_W);
  gained.v += step_s * a.v;
  gained.w += step_s * a.w;
}

double in_series(double stiffness_a, double stiffness_b) {
  return stiffness_a * stiffness_b / (stiffness_a + stiffness_b);
}

}  // namespace

TouchStage::TouchStage(const Limits& limits)
    : limits_(limits),
      inertialess_(limits.things, limits.couplings, limits.speed_m_per_s),
      pairs_(limits.things, limits.pairs, limits.contact_points),
      felt_(limits.things),
      gained_(limits.things),
      reach_m_(limits.things),
      body_of_thing_(limits.things, contact::kStaticBody),
      results_(limits.pairs),
      solver_({limits.things, 2 * limits.couplings + limits.joints, limits.pairs,
               std::min(limits.pairs * limits.contact_points, kMaxRows), 30}) {
  thing_of_body_.reserve(limits.things);
  bodies_.reserve(limits.things);
  couplings_.reserve(2 * limits.couplings + limits.joints);
  answers_.reserve(limits.couplings + limits.joints);
  tool_wrenches_.resize(2 * limits.couplings + limits.joints);
  patches_.reserve(limits.pairs);
  patch_pairs_.reserve(limits.pairs);
  patch_things_.reserve(limits.pairs);
  patch_normals_W_.reserve(limits.pairs);
}

TickFaults TouchStage::step(double step_s, std::span<TouchThing> things, std::span<TouchCoupling> couplings,
                            std::span<TouchJoint> joints) noexcept {
  TickFaults faults = inertialess_.follow(step_s, things, couplings, joints);
  predict_reach(step_s, things, couplings, joints);
  faults |= pairs_.find(things, reach_m_);
  add_bodies(things);
  faults |= find_contacts(things);
  add_couplings(things, couplings, joints);
  faults |= solve(step_s);
  feel();
  inertialess_.show_contacts(step_s, things, felt_, couplings, joints);
  find_reached(things);
  faults |= write_back(step_s, things);
  return faults;
}

/// Searches contacts for the next step. If any object is at its handle, nothing is searched, because the next pose of
/// that object is unknown.
void TouchStage::look_ahead(double step_s, std::span<const TouchThing> things) noexcept {
  for (contact::SolverPatch& patch : patches_) patch.contacts = {};
  const auto jumps = [](const TouchThing& thing) {
    return thing.role == TouchThing::Role::kImplicit && thing.is_at_handle();
  };
  if (std::ranges::any_of(things, jumps)) return;
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (may_move(things[i])) reach_m_[i] = kLikelyReach * reach_m_[i] + kLikelyPush_m_per_s2 * step_s * step_s;
  }
  pairs_.look_ahead(things, reach_m_);
  for (NearPairs::Pair* const near : pairs_.near()) {
    near->find_ahead(pose_of(things, near->thing_a, near->part_a), pose_of(things, near->thing_b, near->part_b));
  }
}

// Computes each object's reach from its present velocity and from the velocity that the wrenches add in this step.
void TouchStage::predict_reach(double step_s, std::span<const TouchThing> things,
                               std::span<const TouchCoupling> couplings, std::span<const TouchJoint> joints) noexcept {
  std::fill(gained_.begin(), gained_.end(), Twist{});
  std::fill(reach_m_.begin(), reach_m_.end(), 0.0);
  for (const TouchCoupling& coupling : couplings) {
    const RigidBody& rigid = *things[coupling.thing].rigid;
    const Wrench wrench_W = about_centre_W(coupling.hand->coupling(0, coupling.X_WT), rigid);
    gain(step_s, wrench_W, rigid, gained_[coupling.thing]);
  }
  for (const TouchJoint& joint : joints) {
    const RigidBody& rigid = *things[joint.thing].rigid;
    gain(step_s, about_centre_W(joint.coupling(0), rigid), rigid, gained_[joint.thing]);
  }
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (!may_move(things[i])) continue;
    if (!things[i].has_inertia()) {
      reach_m_[i] = inertialess_.reach_m(step_s, things[i], i);
      continue;
    }
    const RigidBody& rigid = *things[i].rigid;
    gain(step_s, things[i].wrench_W, rigid, gained_[i]);
    const Twist& V = rigid.velocity_of_centre_W();
    // A contact may prevent the object from gaining the velocity, so the larger of the speeds with and without the gain
    // is used.
    const double linear = std::max(V.v.norm(), (V.v + gained_[i].v).norm());
    const double angular = std::max(V.w.norm(), (V.w + gained_[i].w).norm());
    reach_m_[i] = step_s * std::min(linear + rigid.radius_m() * angular, limits_.speed_m_per_s);
  }
}

void TouchStage::add_bodies(std::span<const TouchThing> things) noexcept {
  bodies_.clear();
  thing_of_body_.clear();
  std::fill(body_of_thing_.begin(), body_of_thing_.end(), contact::kStaticBody);
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].role == TouchThing::Role::kImplicit) add_body(things, i);
  }
}

void TouchStage::add_body(std::span<const TouchThing> things, std::size_t thing) noexcept {
  const RigidBody& rigid = *things[thing].rigid;
  body_of_thing_[thing] = static_cast<int>(bodies_.size());
  thing_of_body_.push_back(thing);
  bodies_.push_back({rigid.mass().mass_kg, rigid.inertia_W(), rigid.centre_W(), rigid.velocity_of_centre_W(),
                     things[thing].wrench_W});
  if (!things[thing].has_inertia()) inertialess_.describe(things[thing], thing, bodies_.back());
}

TickFaults TouchStage::find_contacts(std::span<const TouchThing> things) noexcept {
  TickFaults faults = 0;
  patches_.clear();
  patch_pairs_.clear();
  patch_things_.clear();
  for (NearPairs::Pair* const near : pairs_.near()) {
    const contact::ContactWork work =
        near->find(pose_of(things, near->thing_a, near->part_a), pose_of(things, near->thing_b, near->part_b));
    if (work.is_coarse) faults |= kFaultContactCoarse;
    pairs_.join(things, *near);
    if (!near->contacts.contacts().empty()) add_patch(things, *near);
  }
  return faults;
}

/// Adds the contacts of a pair to the solver. With its first contact, an external object becomes a body of the solver.
void TouchStage::add_patch(std::span<const TouchThing> things, NearPairs::Pair& near) noexcept {
  const TouchThing& a = things[near.thing_a];
  const TouchThing& b = things[near.thing_b];
  for (const std::size_t thing : {near.thing_a, near.thing_b}) {
    const bool is_external = things[thing].role == TouchThing::Role::kExternal;
    if (is_external && body_of_thing_[thing] == contact::kStaticBody) add_body(things, thing);
  }
  contact::SolverPatch patch;
  patch.a = body_of_thing_[near.thing_a];
  patch.b = body_of_thing_[near.thing_b];
  patch.contacts = near.contacts.contacts();
  patch.stiffness_n_per_m3 = in_series(a.model->stiffness_n_per_m3, b.model->stiffness_n_per_m3);
  patch.rigid_depth_m =
      std::min(a.model->parts[near.part_a].shape->rigid_depth_m, b.model->parts[near.part_b].shape->rigid_depth_m);
  patch.friction = std::sqrt(a.rigid->friction() * b.rigid->friction());
  patches_.push_back(patch);
  patch_pairs_.push_back(&near);
  patch_things_.push_back({near.thing_a, near.thing_b});
}

/// Adds the couplings and joints that are part of the solution. Two kinds are not:
/// * those of objects at their handle (InertialessThings::show_contacts())
/// * joints of external objects without contact
void TouchStage::add_couplings(std::span<const TouchThing> things, std::span<TouchCoupling> couplings,
                               std::span<TouchJoint> joints) noexcept {
  couplings_.clear();
  answers_.clear();
  for (TouchCoupling& coupling : couplings) {
    if (things[coupling.thing].is_at_handle()) continue;
    add_coupling(coupling.hand->coupling(body_of_thing_[coupling.thing], coupling.X_WT), coupling.wrench_W);
  }
  for (TouchJoint& joint : joints) {
    const int body = body_of_thing_[joint.thing];
    joint.is_solved = body != contact::kStaticBody && !things[joint.thing].is_at_handle();
    joint.wrench_W = Wrench{};
    if (joint.is_solved) add_coupling(joint.coupling(body), joint.wrench_W);
  }
  inertialess_.add_drags(things, body_of_thing_, couplings_);
}

void TouchStage::add_coupling(const contact::SolverCoupling& coupling, Wrench& answer) noexcept {
  couplings_.push_back(coupling);
  answers_.push_back(&answer);
}

TickFaults TouchStage::solve(double step_s) noexcept {
  const std::span wrenches(tool_wrenches_.data(), couplings_.size());
  const std::span results(results_.data(), patches_.size());
  const contact::SolverReport report = solver_.step(step_s, bodies_, couplings_, patches_, results, wrenches);
  for (std::size_t i = 0; i < answers_.size(); ++i) *answers_[i] = wrenches[i];
  TickFaults faults = 0;
  if (!report.has_converged) faults |= kFaultContactUnsolved;
  if (report.left_out > report.ill_formed) faults |= kFaultContactCoarse;
  if (report.ill_formed > 0) faults |= kFaultNotFinite;
  return faults;
}

void TouchStage::feel() noexcept {
  std::fill(felt_.begin(), felt_.end(), TouchContact{});
  for (NearPairs::Pair* const near : pairs_.near()) near->deepest_m = 0;
  patch_normals_W_.clear();
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    patch_normals_W_.push_back(normal_of(patches_[i].contacts));
    const auto add = [&](std::size_t thing, const Wrench& wrench) {
      felt_[thing].pressing += results_[i].pressing;
      felt_[thing].deepest_m = std::max(felt_[thing].deepest_m, results_[i].deepest_m);
      felt_[thing].wrench_W += wrench;
    };
    add(patch_things_[i][0], results_[i].on_a_W);
    add(patch_things_[i][1], -results_[i].on_a_W);
    patch_pairs_[i]->deepest_m = results_[i].deepest_m;
  }
}

/// Propagates is_reached and the set of hands from object to object through contacts, starting from the objects that
/// make others implicit. The loop repeats until nothing changes; chains of touching objects are short.
void TouchStage::find_reached(std::span<const TouchThing> things) noexcept {
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].role != TouchThing::Role::kImplicit) continue;
    felt_[i].is_reached = things[i].makes_implicit;
    felt_[i].hands = things[i].hands;
  }
  const auto moves = [&things](std::size_t i) { return things[i].role != TouchThing::Role::kStatic; };
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      const auto [thing_a, thing_b] = patch_things_[i];
      if (results_[i].pressing == 0 || !moves(thing_a) || !moves(thing_b)) continue;
      TouchContact& a = felt_[thing_a];
      TouchContact& b = felt_[thing_b];
      if (a.is_reached == b.is_reached && a.hands == b.hands) continue;
      a.is_reached = b.is_reached = true;
      a.hands = b.hands = a.hands | b.hands;
      has_grown = true;
    }
  }
}

TickFaults TouchStage::write_back(double step_s, std::span<TouchThing> things) noexcept {
  TickFaults faults = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    TouchThing& thing = things[thing_of_body_[i]];
    TouchContact& felt = felt_[thing_of_body_[i]];
    if (thing.role != TouchThing::Role::kImplicit) {
      thing.rigid->apply_wrench(felt.wrench_W, Vec3::Zero());
      continue;
    }
    if (limit_motion(bodies_[i].V_WC, 2 * thing.model->radius_m, limits_.speed_m_per_s)) faults |= kFaultSpeedLimited;
    if (thing.has_inertia()) {
      thing.rigid->advance(bodies_[i].V_WC, step_s);
    } else {
      thing.rigid->move(bodies_[i].V_WC, step_s);
    }
    felt.V_WC = bodies_[i].V_WC;
    if (thing.is_massless()) thing.rigid->set_state({thing.rigid->pose(), Twist{}});
  }
  return faults;
}

template <class Use>
void TouchStage::for_each_pressed_W(std::size_t thing, const Use& use) const noexcept {
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const auto [thing_a, thing_b] = patch_things_[i];
    if (results_[i].pressing == 0 || (thing_a != thing && thing_b != thing)) continue;
    for (const contact::ContactPoint& contact : patches_[i].contacts) {
      if (contact.depth_m > 0) use(contact.p_W);
    }
  }
}

std::size_t TouchStage::pressed_points_W(std::size_t thing, std::span<Vec3> out) const noexcept {
  std::size_t count = 0, index = 0, written = 0;
  for_each_pressed_W(thing, [&count](const Vec3&) { ++count; });
  const std::size_t kept = std::min(count, out.size());
  for_each_pressed_W(thing, [&](const Vec3& p_W) {
    if (written < kept && index++ * kept / count == written) out[written++] = p_W;
  });
  return written;
}

TouchBetween TouchStage::between(std::size_t thing, std::size_t other) const noexcept {
  TouchBetween sum;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const auto [thing_a, thing_b] = patch_things_[i];
    const bool is_first = thing_a == thing && thing_b == other;
    if (!is_first && (thing_a != other || thing_b != thing)) continue;
    sum.normal_force_n += results_[i].normal_force_n;
    sum.normal_W += (is_first ? 1 : -1) * patch_normals_W_[i];
  }
  const double length = sum.normal_W.norm();
  if (length > 0) sum.normal_W /= length;
  return sum;
}

}  // namespace tandem::physics
