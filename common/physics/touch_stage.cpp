#include "common/physics/touch_stage.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/contact/shape_distance.hpp"
#include "common/haptics/coupling/saturation.hpp"

namespace tandem::physics {
namespace {

/// Shapes nearer than this are searched for contacts even when they are at rest.
constexpr double kMinBand_m = 2e-4;

/// Pairs of shapes that may be near at a time, of which limits.pairs are searched.
constexpr std::size_t kMaxNear = 4096;

/// Rows of the solver: contacts of all pairs in a step.
constexpr std::size_t kMaxRows = 65536;

/// A thing must not get farther than predict_reach() says: what it would meet there was not looked for. Moving less
/// than was solved for is safe, for it is less of the same way. True when it had to be slowed.
bool limit_motion(Twist& V_WC, double radius_m, const TouchStage::Limits& limits) {
  const double fastest = V_WC.v.norm() + V_WC.w.norm() * radius_m;
  if (!(fastest > limits.speed_m_per_s)) return false;
  V_WC.v *= limits.speed_m_per_s / fastest;
  V_WC.w *= limits.speed_m_per_s / fastest;
  return true;
}

/// What a law does to the frame X_WT of `rigid` now, about the centre of mass.
Wrench about_centre_W(const contact::SolverCoupling& coupling, const RigidBody& rigid) {
  const Pose& X_WT = coupling.X_WT;
  const Twist V_WT{rigid.velocity_at_W(X_WT.p), rigid.velocity_of_centre_W().w};
  const Wrench on_tool = haptics::coupling_wrenches(*coupling.law, coupling.X_WH, coupling.V_WH, X_WT, V_WT).on_tool_W;
  return {on_tool.f, on_tool.t + (X_WT.p - rigid.centre_W()).cross(on_tool.f)};
}

contact::SolverCoupling coupling_of(const TouchTie& tie, int body) {
  return {body, tie.law, tie.target.X, tie.target.V, tie.X_WT};
}

/// Inertia that stands for none: what it resists within a step is this part of what the coupling's spring does, so that
/// the tool ends where it would without, to as many parts. Ours; the matrix of the solver stays that well conditioned.
constexpr double kInertiaOfNone = 1e-4;
/// With a spring of zero. A step of 1 mm then takes 1e-6 N at 1 kHz.
constexpr double kMassOfNone_kg = 1e-9;
/// Its turning mass is at this distance, at least; as kToolGyrationRadius_m.
constexpr double kGyrationOfNone_m = 0.015;

/// What takes a thing from where it is to where the hand wants the tool T, within a step.
Twist twist_to_handle(const Pose& X_WH, const Pose& X_WT, const Vec3& p_WC, double step_s) {
  const Vec3 turn = rotation_vector(X_WH.q * X_WT.q.conjugate());
  const Vec3 p_WC_then = X_WH.p - quaternion_of(turn) * (X_WT.p - p_WC);
  return {(p_WC_then - p_WC) / step_s, turn / step_s};
}

double in_a_row(double stiffness_a, double stiffness_b) {
  return stiffness_a * stiffness_b / (stiffness_a + stiffness_b);
}

}  // namespace

void TouchDrag::add(const EffectDamping& more, const Twist& V_more_W, double more_force_n,
                    double more_torque_n_m) noexcept {
  const auto mix = [](Vec3& mean, double& sum, const Vec3& value, double weight) {
    sum += weight;
    if (sum > 0) mean += weight / sum * (value - mean);
  };
  mix(V_W.v, damping.n_s_per_m, V_more_W.v, more.n_s_per_m);
  mix(V_W.w, damping.n_m_s_per_rad, V_more_W.w, more.n_m_s_per_rad);
  force_limit_n += more_force_n;
  torque_limit_n_m += more_torque_n_m;
}

TouchStage::TouchStage(const Limits& limits)
    : limits_(limits),
      felt_(limits.things),
      gained_(limits.things),
      leads_(limits.things),
      reach_m_(limits.things),
      body_of_thing_(limits.things, contact::kStaticBody),
      results_(limits.pairs),
      solver_({limits.things, 2 * limits.pulls + limits.ties, limits.pairs,
               std::min(limits.pairs * limits.budget.points, kMaxRows), 30}) {
  slots_.reserve(limits.pairs);
  for (std::size_t i = 0; i < limits.pairs; ++i) slots_.emplace_back(limits.budget);
  near_.reserve(std::max(limits.pairs, kMaxNear));
  thing_of_body_.reserve(limits.things);
  bodies_.reserve(limits.things);
  couplings_.reserve(2 * limits.pulls + limits.ties);
  drag_laws_.resize(limits.pulls, haptics::SpringDamper(haptics::CouplingParameters{}));
  tool_wrenches_.resize(2 * limits.pulls + limits.ties);
  patches_.reserve(limits.pairs);
  patch_slots_.reserve(limits.pairs);
}

TickFaults TouchStage::step(double step_s, std::span<TouchThing> things, std::span<TouchPull> pulls,
                            std::span<TouchTie> ties) noexcept {
  TickFaults faults = follow_hands(step_s, things, pulls);
  follow_ties(step_s, things, ties);
  predict_reach(step_s, things, pulls, ties);
  faults |= find_near(things);
  faults |= choose_nearest();
  bind_slots(things);
  bodies_.clear();
  thing_of_body_.clear();
  patches_.clear();
  patch_slots_.clear();
  std::fill(body_of_thing_.begin(), body_of_thing_.end(), contact::kStaticBody);
  std::fill(felt_.begin(), felt_.end(), TouchContact{});
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].role == TouchThing::Role::kOurs) add_body(things, i);
  }
  faults |= find_contacts(things);
  faults |= solve(step_s, things, pulls, ties);
  faults |= write_back(step_s, things);
  return faults;
}

/// A thing at the handle is slowed before it moves, so that its contacts are those of where it gets.
TickFaults TouchStage::follow_hands(double step_s, std::span<const TouchThing> things,
                                    std::span<const TouchPull> pulls) noexcept {
  TickFaults faults = 0;
  std::fill(leads_.begin(), leads_.end(), Lead{0, Twist{}, 0, 0, 0, Vec3::Zero()});
  for (const TouchPull& pull : pulls) ++leads_[pull.thing].hands;
  for (const TouchPull& pull : pulls) {
    const TouchThing& thing = things[pull.thing];
    Lead& lead = leads_[pull.thing];
    const Twist V_WC = twist_to_handle(pull.hand->target_pose(), pull.X_WT, thing.rigid->centre_W(), step_s);
    // Of several hands the middle.
    lead.V_WC.v += V_WC.v / lead.hands;
    lead.V_WC.w += V_WC.w / lead.hands;
    // Beside what holds it back, a massless tool slides as far as it was off the handle: its spring gets no longer.
    lead.reach_m += 2 * step_s * (V_WC.v.norm() + 2 * thing.model->radius_m * V_WC.w.norm());
    lead.lever_W = pull.X_WT.p - thing.rigid->centre_W();
    const haptics::CouplingParameters& spring = pull.hand->parameters();
    const double squared = kInertiaOfNone * pull.hand->strength() * step_s * step_s;
    lead.mass_kg += squared * spring.stiffness_n_per_m;
    lead.inertia_kg_m2 += squared * spring.stiffness_n_m_per_rad;
  }
  for (std::size_t i = 0; i < things.size(); ++i) {
    Lead& lead = leads_[i];
    if (things[i].role != TouchThing::Role::kOurs) continue;
    const bool is_slowed = limit_motion(lead.V_WC, 2 * things[i].model->radius_m, limits_);
    if (is_slowed && things[i].dynamics == haptics::ToolDynamics::kAtHandle) faults |= kFaultSpeedLimited;
    lead.mass_kg = std::max(lead.mass_kg, kMassOfNone_kg);
    lead.inertia_kg_m2 = std::max(lead.inertia_kg_m2, lead.mass_kg * kGyrationOfNone_m * kGyrationOfNone_m);
  }
  return faults;
}

/// A massless thing goes where its ties pull it too.
void TouchStage::follow_ties(double step_s, std::span<const TouchThing> things,
                             std::span<const TouchTie> ties) noexcept {
  for (const TouchTie& tie : ties) {
    const TouchThing& thing = things[tie.thing];
    if (thing.dynamics != haptics::ToolDynamics::kMassless) continue;
    Lead& lead = leads_[tie.thing];
    const Twist V_WC = twist_to_handle(tie.target.X, tie.X_WT, thing.rigid->centre_W(), step_s);
    const Twist& V = tie.target.V;
    lead.reach_m +=
        2 * step_s * (V_WC.v.norm() + V.v.norm() + 2 * thing.model->radius_m * (V_WC.w.norm() + V.w.norm()));
    if (lead.hands == 0) lead.lever_W = tie.X_WT.p - thing.rigid->centre_W();
    const double squared = kInertiaOfNone * step_s * step_s;
    lead.mass_kg = std::max(lead.mass_kg, squared * tie.law->joint().stiffness_n_per_m);
    lead.inertia_kg_m2 = std::max(lead.inertia_kg_m2, squared * tie.law->joint().stiffness_n_m_per_rad);
  }
}

void TouchStage::gain(double step_s, const TouchThing& thing, std::size_t index,
                      const contact::SolverCoupling& coupling) noexcept {
  if (thing.dynamics != haptics::ToolDynamics::kWithMass) return;
  const Wrench wrench = about_centre_W(coupling, *thing.rigid);
  gained_[index].v += step_s / thing.rigid->mass().mass_kg * wrench.f;
  gained_[index].w += step_s * thing.rigid->inertia_W().inverse() * wrench.t;
}

// As fast as a thing is, and as what pulls it will make it.
void TouchStage::predict_reach(double step_s, std::span<const TouchThing> things, std::span<const TouchPull> pulls,
                               std::span<const TouchTie> ties) noexcept {
  std::fill(gained_.begin(), gained_.end(), Twist{Vec3::Zero(), Vec3::Zero()});
  std::fill(reach_m_.begin(), reach_m_.end(), 0.0);
  for (const TouchPull& pull : pulls) {
    gain(step_s, things[pull.thing], pull.thing, pull.hand->coupling(0, pull.X_WT));
  }
  for (const TouchTie& tie : ties) gain(step_s, things[tie.thing], tie.thing, coupling_of(tie, 0));
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].role != TouchThing::Role::kOurs && things[i].role != TouchThing::Role::kGuest) continue;
    if (things[i].dynamics != haptics::ToolDynamics::kWithMass) {
      reach_m_[i] = std::min(massless_reach_m(step_s, things[i], leads_[i]), step_s * limits_.speed_m_per_s);
      continue;
    }
    const RigidBody& rigid = *things[i].rigid;
    gained_[i].v += step_s / rigid.mass().mass_kg * things[i].wrench_W.f;
    gained_[i].w += step_s * rigid.inertia_W().inverse() * things[i].wrench_W.t;
    const Twist V = things[i].rigid->velocity_of_centre_W();
    // What it gains may as well be stopped before: the faster of both.
    const double linear = std::max(V.v.norm(), (V.v + gained_[i].v).norm());
    const double angular = std::max(V.w.norm(), (V.w + gained_[i].w).norm());
    reach_m_[i] = step_s * std::min(linear + 2 * things[i].model->radius_m * angular, limits_.speed_m_per_s);
  }
}

/// What pushes and turns from outside stretches the spring, and a fluid carries along.
double TouchStage::massless_reach_m(double step_s, const TouchThing& thing, const Lead& lead) const noexcept {
  const Vec3& f = thing.wrench_W.f;
  const Vec3 about_tool_W = thing.wrench_W.t - lead.lever_W.cross(f);
  // Twice: a curved law gives way more than its first slope says.
  const double squared = 2 * kInertiaOfNone * step_s * step_s;
  const double moved_m = squared * f.norm() / lead.mass_kg;
  const double turned_rad = squared * about_tool_W.norm() / lead.inertia_kg_m2;
  const double carried_m = thing.drag.is_there() ? step_s * thing.drag.V_W.v.norm() : 0;
  const double carried_rad = thing.drag.is_there() ? step_s * thing.drag.V_W.w.norm() : 0;
  return lead.reach_m + moved_m + carried_m + 2 * thing.model->radius_m * (turned_rad + carried_rad);
}

TickFaults TouchStage::find_near(std::span<const TouchThing> things) noexcept {
  near_.clear();
  bool has_room = true;
  for (std::size_t a = 0; a < things.size(); ++a) {
    if (things[a].role != TouchThing::Role::kOurs || !things[a].model->can_be_touched()) continue;
    for (std::size_t b = 0; b < things.size(); ++b) {
      const TouchThing& other = things[b];
      // Two of ours meet once.
      const bool is_met_later = other.role == TouchThing::Role::kOurs && b <= a;
      if (other.role == TouchThing::Role::kAbsent || is_met_later || !other.model->can_be_touched()) continue;
      if (things[a].passes_through == b || other.passes_through == a) continue;
      // Half as much again: a contact can push its neighbour on within the step.
      const double band = std::max(kMinBand_m, 1.5 * (reach_m_[a] + reach_m_[b]));
      has_room = add_near(things, a, b, band) && has_room;
    }
  }
  return has_room ? TickFaults{0} : TickFaults{kFaultContactCoarse};
}

bool TouchStage::add_near(std::span<const TouchThing> things, std::size_t a, std::size_t b, double band_m) noexcept {
  const Pose X_WA = things[a].rigid->state().X;
  const Pose X_WB = things[b].rigid->state().X;
  const TouchModel& model_a = *things[a].model;
  const TouchModel& model_b = *things[b].model;
  if ((X_WA.p - X_WB.p).norm() > model_a.radius_m + model_b.radius_m + band_m) return true;
  for (std::size_t i = 0; i < model_a.parts.size(); ++i) {
    for (std::size_t j = 0; j < model_b.parts.size(); ++j) {
      const Pose X_WSa = X_WA * model_a.parts[i].X_BS;
      const Pose X_WSb = X_WB * model_b.parts[j].X_BS;
      const contact::ContactShape& shape_a = *model_a.parts[i].shape;
      const contact::ContactShape& shape_b = *model_b.parts[j].shape;
      if (!contact::boxes_are_near(shape_a, X_WSa, shape_b, X_WSb, band_m)) continue;
      if (near_.size() == near_.capacity()) return false;
      near_.push_back({{static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(b),
                        static_cast<std::uint16_t>(j)},
                       band_m,
                       nullptr});
    }
  }
  return true;
}

/// Finds the slots of pairs that have one. Of too many pairs, those that press deepest stay, then those that were near
/// before.
TickFaults TouchStage::choose_nearest() noexcept {
  const auto used = std::span(slots_).first(slots_end_);
  for (Near& near : near_) {
    const auto is_same = [&near](const Slot& slot) { return slot.is_used && slot.key == near.key; };
    const auto found = std::find_if(used.begin(), used.end(), is_same);
    if (found != used.end()) near.slot = &*found;
  }
  if (near_.size() <= limits_.pairs) return 0;
  const auto is_before = [](const Near& x, const Near& y) {
    if (x.deepest_m() != y.deepest_m()) return x.deepest_m() > y.deepest_m();
    if ((x.slot != nullptr) != (y.slot != nullptr)) return x.slot != nullptr;
    return std::tie(x.key.thing_a, x.key.thing_b, x.key.part_a, x.key.part_b) <
           std::tie(y.key.thing_a, y.key.thing_b, y.key.part_a, y.key.part_b);
  };
  std::sort(near_.begin(), near_.end(), is_before);
  near_.resize(limits_.pairs);
  return kFaultContactCoarse;
}

void TouchStage::bind_slots(std::span<const TouchThing> things) noexcept {
  const auto used = std::span(slots_).first(slots_end_);
  for (Slot& slot : used) slot.is_near = false;
  for (Near& near : near_) {
    if (near.slot != nullptr) near.slot->is_near = true;
  }
  for (Slot& slot : used) {
    slot.is_used = slot.is_used && slot.is_near;
    slot.deepest_m = 0;
  }
  while (slots_end_ > 0 && !slots_[slots_end_ - 1].is_used) --slots_end_;
  for (Near& near : near_) {
    if (near.slot != nullptr) continue;
    // There are as many slots as near pairs at most.
    const auto free = std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) { return !slot.is_used; });
    slots_end_ = std::max(slots_end_, static_cast<std::size_t>(free - slots_.begin()) + 1);
    free->is_used = true;
    free->key = near.key;
    free->pair.bind(things[near.key.thing_a].model->parts[near.key.part_a].shape.get(),
                    things[near.key.thing_b].model->parts[near.key.part_b].shape.get());
    near.slot = &*free;
  }
}

void TouchStage::add_body(std::span<const TouchThing> things, std::size_t thing) noexcept {
  const RigidBody& rigid = *things[thing].rigid;
  body_of_thing_[thing] = static_cast<int>(bodies_.size());
  thing_of_body_.push_back(thing);
  contact::SolverBody body{rigid.mass().mass_kg, rigid.inertia_W(), rigid.centre_W(), rigid.velocity_of_centre_W(),
                           things[thing].wrench_W};
  const Lead& lead = leads_[thing];
  if (things[thing].dynamics == haptics::ToolDynamics::kMassless) {
    body.mass_kg = lead.mass_kg;
    body.inertia_W = lead.inertia_kg_m2 * Eigen::Matrix3d::Identity();
    body.V_WC = {Vec3::Zero(), Vec3::Zero()};
  } else if (things[thing].dynamics == haptics::ToolDynamics::kAtHandle) {
    body.V_WC = lead.V_WC;
    body.is_prescribed = true;
  }
  bodies_.push_back(body);
}

TickFaults TouchStage::find_contacts(std::span<const TouchThing> things) noexcept {
  TickFaults faults = 0;
  for (const Near& near : near_) {
    const TouchThing& a = things[near.key.thing_a];
    const TouchThing& b = things[near.key.thing_b];
    const Pose X_WA = a.rigid->state().X * a.model->parts[near.key.part_a].X_BS;
    const Pose X_WB = b.rigid->state().X * b.model->parts[near.key.part_b].X_BS;
    const contact::ContactWork work = near.slot->pair.find(X_WA, X_WB, near.band_m);
    if (work.is_coarse) faults |= kFaultContactCoarse;
    if (!near.slot->pair.contacts().empty()) add_patch(things, near);
  }
  return faults;
}

void TouchStage::add_patch(std::span<const TouchThing> things, const Near& near) noexcept {
  const TouchThing& a = things[near.key.thing_a];
  const TouchThing& b = things[near.key.thing_b];
  if (b.role == TouchThing::Role::kGuest && body_of_thing_[near.key.thing_b] == contact::kStaticBody) {
    add_body(things, near.key.thing_b);
  }
  contact::SolverPatch patch;
  patch.a = body_of_thing_[near.key.thing_a];
  patch.b = body_of_thing_[near.key.thing_b];
  patch.contacts = near.slot->pair.contacts();
  patch.stiffness_n_per_m3 = in_a_row(a.model->stiffness_n_per_m3, b.model->stiffness_n_per_m3);
  patch.rigid_depth_m = std::min(a.model->parts[near.key.part_a].shape->rigid_depth_m,
                                 b.model->parts[near.key.part_b].shape->rigid_depth_m);
  patch.friction = std::sqrt(a.rigid->friction() * b.rigid->friction());
  patches_.push_back(patch);
  patch_slots_.push_back(near.slot);
}

bool TouchStage::is_solved_for(std::span<const TouchThing> things, const TouchTie& tie) const noexcept {
  return things[tie.thing].dynamics != haptics::ToolDynamics::kAtHandle &&
         body_of_thing_[tie.thing] != contact::kStaticBody;
}

void TouchStage::add_couplings(std::span<const TouchThing> things, std::span<const TouchPull> pulls,
                               std::span<const TouchTie> ties) noexcept {
  couplings_.clear();
  for (const TouchPull& pull : pulls) {
    if (things[pull.thing].dynamics == haptics::ToolDynamics::kAtHandle) continue;
    couplings_.push_back(pull.hand->coupling(body_of_thing_[pull.thing], pull.X_WT));
  }
  for (const TouchTie& tie : ties) {
    if (is_solved_for(things, tie)) couplings_.push_back(coupling_of(tie, body_of_thing_[tie.thing]));
  }
  add_drags(things);
}

void TouchStage::add_drags(std::span<const TouchThing> things) noexcept {
  std::size_t drags = 0;
  for (std::size_t i = 0; i < things.size() && drags < drag_laws_.size(); ++i) {
    const TouchDrag& drag = things[i].drag;
    if (things[i].dynamics != haptics::ToolDynamics::kMassless || body_of_thing_[i] == contact::kStaticBody ||
        !drag.is_there())
      continue;
    haptics::SpringDamper& law = drag_laws_[drags++];
    law.set_parameters(
        {0, drag.damping.n_s_per_m, 0, drag.damping.n_m_s_per_rad, drag.force_limit_n, drag.torque_limit_n_m, 0, 1});
    const Pose X_W = things[i].rigid->state().X;
    couplings_.push_back({body_of_thing_[i], &law, X_W, drag.V_W, X_W});
  }
}

TickFaults TouchStage::solve(double step_s, std::span<const TouchThing> things, std::span<TouchPull> pulls,
                             std::span<TouchTie> ties) noexcept {
  add_couplings(things, pulls, ties);
  const std::span wrenches(tool_wrenches_.data(), couplings_.size());
  const std::span results(results_.data(), patches_.size());
  const contact::SolverReport report = solver_.step(step_s, bodies_, couplings_, patches_, results, wrenches);
  feel();
  std::size_t next = 0;
  for (TouchPull& pull : pulls) {
    if (things[pull.thing].dynamics != haptics::ToolDynamics::kAtHandle) pull.wrench_W = wrenches[next++];
  }
  for (TouchTie& tie : ties) {
    tie.is_solved = is_solved_for(things, tie);
    tie.wrench_W = tie.is_solved ? wrenches[next++] : Wrench{};
  }
  show_contacts(step_s, things, pulls, ties);
  TickFaults faults = 0;
  if (!report.has_converged) faults |= kFaultContactUnsolved;
  if (report.left_out > report.ill_formed) faults |= kFaultContactCoarse;
  if (report.ill_formed > 0) faults |= kFaultNotFinite;
  return faults;
}

void TouchStage::feel() noexcept {
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const auto add = [&](std::size_t thing, const Wrench& wrench) {
      felt_[thing].pressing += results_[i].pressing;
      felt_[thing].deepest_m = std::max(felt_[thing].deepest_m, results_[i].deepest_m);
      felt_[thing].wrench_W += wrench;
    };
    add(patch_slots_[i]->key.thing_a, results_[i].on_a_W);
    add(patch_slots_[i]->key.thing_b, -results_[i].on_a_W);
    patch_slots_[i]->deepest_m = results_[i].deepest_m;
  }
}

/// The hand carries what bears on a thing that is where the hand is, within the limits of its coupling.
void TouchStage::show_contacts(double step_s, std::span<const TouchThing> things, std::span<TouchPull> pulls,
                               std::span<TouchTie> ties) const noexcept {
  for (TouchTie& tie : ties) {
    const TouchThing& thing = things[tie.thing];
    if (thing.role != TouchThing::Role::kOurs || thing.dynamics != haptics::ToolDynamics::kAtHandle) continue;
    contact::SolverCoupling there = coupling_of(tie, 0);
    const Twist& V_WC = leads_[tie.thing].V_WC;
    const Vec3 p_WC = thing.rigid->centre_W();
    const Vec3 lever_W = quaternion_of(V_WC.w * step_s) * (tie.X_WT.p - p_WC);
    there.X_WT = {p_WC + step_s * V_WC.v + lever_W, quaternion_of(V_WC.w * step_s) * tie.X_WT.q};
    const Twist V_WT{V_WC.v + V_WC.w.cross(lever_W), V_WC.w};
    tie.wrench_W = haptics::coupling_wrenches(*there.law, there.X_WH, there.V_WH, there.X_WT, V_WT).on_tool_W;
    tie.is_solved = true;
  }
  for (TouchPull& pull : pulls) {
    const TouchThing& thing = things[pull.thing];
    if (thing.dynamics != haptics::ToolDynamics::kAtHandle) continue;
    const Lead& lead = leads_[pull.thing];
    const Vec3 p_WC = thing.rigid->centre_W();
    const Vec3 lever_W = quaternion_of(lead.V_WC.w * step_s) * (pull.X_WT.p - p_WC);
    const Vec3 p_WT = p_WC + step_s * lead.V_WC.v + lever_W;
    const Wrench& contact = felt_[pull.thing].wrench_W;
    Vec3 force = contact.f + thing.wrench_W.f;
    Vec3 torque = contact.t - p_WT.cross(contact.f) + thing.wrench_W.t - lever_W.cross(thing.wrench_W.f);
    for (const TouchTie& tie : ties) {
      if (tie.thing != pull.thing) continue;
      force += tie.wrench_W.f;
      torque +=
          tie.wrench_W.t + (quaternion_of(lead.V_WC.w * step_s) * (tie.X_WT.p - pull.X_WT.p)).cross(tie.wrench_W.f);
    }
    const haptics::CouplingParameters& c = pull.hand->parameters();
    pull.wrench_W = {haptics::saturated(Vec3(-force / lead.hands), c.force_limit_n, c.saturation_softness),
                     haptics::saturated(Vec3(-torque / lead.hands), c.torque_limit_n_m, c.saturation_softness)};
  }
}

/// From led things outwards, until nothing is added: chains are short.
void TouchStage::find_reached(std::span<const TouchThing> things) noexcept {
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].role != TouchThing::Role::kOurs) continue;
    felt_[i].is_reached = things[i].is_led;
    felt_[i].hands = things[i].hands;
  }
  const auto moves = [&things](std::size_t i) { return things[i].role != TouchThing::Role::kStatic; };
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      const Key& key = patch_slots_[i]->key;
      if (results_[i].pressing == 0 || !moves(key.thing_a) || !moves(key.thing_b)) continue;
      TouchContact& a = felt_[key.thing_a];
      TouchContact& b = felt_[key.thing_b];
      if (a.is_reached == b.is_reached && a.hands == b.hands) continue;
      a.is_reached = b.is_reached = true;
      a.hands = b.hands = a.hands | b.hands;
      has_grown = true;
    }
  }
}

TickFaults TouchStage::write_back(double step_s, std::span<TouchThing> things) noexcept {
  TickFaults faults = 0;
  find_reached(things);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    TouchThing& thing = things[thing_of_body_[i]];
    if (thing.role == TouchThing::Role::kOurs) {
      if (limit_motion(bodies_[i].V_WC, 2 * thing.model->radius_m, limits_)) faults |= kFaultSpeedLimited;
      thing.rigid->advance(bodies_[i].V_WC, step_s);
      felt_[thing_of_body_[i]].V_WC = bodies_[i].V_WC;
      if (thing.dynamics == haptics::ToolDynamics::kMassless) thing.rigid->set_state({thing.rigid->state().X, Twist{}});
    } else {
      thing.rigid->apply_wrench(felt_[thing_of_body_[i]].wrench_W, Vec3::Zero());
    }
  }
  return faults;
}

TouchBetween TouchStage::between(std::size_t thing, std::size_t other) const noexcept {
  TouchBetween sum;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const Key& key = patch_slots_[i]->key;
    const bool is_first = key.thing_a == thing && key.thing_b == other;
    if (!is_first && (key.thing_a != other || key.thing_b != thing)) continue;
    sum.normal_force_n += results_[i].normal_force_n;
    for (const contact::ContactPoint& contact : patches_[i].contacts) {
      // As the pressure is: by depth and area.
      const double weight = std::max(0.0, contact.depth_m) * contact.area_m2;
      sum.normal_W += (is_first ? weight : -weight) * contact.normal_W;
    }
  }
  const double length = sum.normal_W.norm();
  if (length > 0) sum.normal_W /= length;
  return sum;
}

}  // namespace tandem::physics
