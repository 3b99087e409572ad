#include "server/touch_stage.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/contact/shape_distance.hpp"

namespace tandem {
namespace {

/// Shapes nearer than this are searched for contacts even when they are at rest.
constexpr double kLeastBand_m = 2e-4;

/// Pairs of shapes that may be near at a time, of which limits.pairs are searched.
constexpr std::size_t kMostNear = 4096;

/// Rows of the solver: contacts of all pairs in a step.
constexpr std::size_t kMostRows = 65536;

/// A thing must not get farther than predict_reach() says: what it would meet there was not looked for. Moving less
/// than was solved for is safe, for it is less of the same way. True when it had to be slowed.
bool limit_motion(Twist& V_WC, double radius_m, const TouchStage::Limits& limits) {
  const double fastest = V_WC.v.norm() + V_WC.w.norm() * radius_m;
  if (!(fastest > limits.speed_m_per_s)) return false;
  V_WC.v *= limits.speed_m_per_s / fastest;
  V_WC.w *= limits.speed_m_per_s / fastest;
  return true;
}

double in_a_row(double stiffness_a, double stiffness_b) {
  return stiffness_a * stiffness_b / (stiffness_a + stiffness_b);
}

}  // namespace

TouchStage::TouchStage(const Limits& limits)
    : limits_(limits),
      felt_(limits.things),
      gained_(limits.things),
      reach_m_(limits.things),
      body_of_thing_(limits.things, kStaticBody),
      results_(limits.pairs),
      solver_(
          {limits.things, limits.pulls, limits.pairs, std::min(limits.pairs * limits.budget.points, kMostRows), 30}) {
  slots_.reserve(limits.pairs);
  for (std::size_t i = 0; i < limits.pairs; ++i) slots_.emplace_back(limits.budget);
  near_.reserve(std::max(limits.pairs, kMostNear));
  thing_of_body_.reserve(limits.things);
  bodies_.reserve(limits.things);
  couplings_.reserve(limits.pulls);
  tool_wrenches_.resize(limits.pulls);
  patches_.reserve(limits.pairs);
  patch_slots_.reserve(limits.pairs);
}

TickFaults TouchStage::step(double step_s, std::span<TouchThing> things, std::span<TouchPull> pulls) noexcept {
  predict_reach(step_s, things, pulls);
  TickFaults faults = find_near(things);
  faults |= choose_nearest();
  bind_slots(things);
  bodies_.clear();
  thing_of_body_.clear();
  patches_.clear();
  patch_slots_.clear();
  std::fill(body_of_thing_.begin(), body_of_thing_.end(), kStaticBody);
  std::fill(felt_.begin(), felt_.end(), TouchContact{});
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].role == TouchThing::Role::kOurs) add_body(things, i);
  }
  faults |= find_contacts(things);
  faults |= solve(step_s, pulls);
  faults |= write_back(step_s, things);
  return faults;
}

// As fast as a thing is, and as what pulls it will make it.
void TouchStage::predict_reach(double step_s, std::span<const TouchThing> things,
                               std::span<const TouchPull> pulls) noexcept {
  std::fill(gained_.begin(), gained_.end(), Twist{Vec3::Zero(), Vec3::Zero()});
  std::fill(reach_m_.begin(), reach_m_.end(), 0.0);
  const auto gain = [&](std::size_t thing, const Wrench& about_centre_W) {
    const RigidBody& rigid = *things[thing].rigid;
    gained_[thing].v += step_s / rigid.mass().mass_kg * about_centre_W.f;
    gained_[thing].w += step_s * rigid.inertia_W().inverse() * about_centre_W.t;
  };
  for (const TouchPull& pull : pulls) {
    const RigidBody& rigid = *things[pull.thing].rigid;
    const SolverCoupling coupling = pull.hand->coupling(0, pull.X_WT);
    const Twist V_WT{rigid.velocity_at_W(pull.X_WT.p), rigid.velocity_of_centre_W().w};
    const Wrench on_tool = coupling_wrenches(*coupling.law, coupling.X_WH, coupling.V_WH, pull.X_WT, V_WT).on_tool_W;
    gain(pull.thing, {on_tool.f, on_tool.t + (pull.X_WT.p - rigid.centre_W()).cross(on_tool.f)});
  }
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].role != TouchThing::Role::kOurs && things[i].role != TouchThing::Role::kGuest) continue;
    gain(i, things[i].wrench_W);
    const Twist V = things[i].rigid->velocity_of_centre_W();
    // What it gains may as well be stopped before: the faster of both.
    const double linear = std::max(V.v.norm(), (V.v + gained_[i].v).norm());
    const double angular = std::max(V.w.norm(), (V.w + gained_[i].w).norm());
    reach_m_[i] = step_s * std::min(linear + 2 * things[i].model->radius_m * angular, limits_.speed_m_per_s);
  }
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
      const double band = std::max(kLeastBand_m, 1.5 * (reach_m_[a] + reach_m_[b]));
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
      const ContactShape& shape_a = *model_a.parts[i].shape;
      const ContactShape& shape_b = *model_b.parts[j].shape;
      if (!boxes_are_near(shape_a, X_WSa, shape_b, X_WSb, band_m)) continue;
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
  for (Near& near : near_) {
    const auto is_same = [&near](const Slot& slot) { return slot.is_used && slot.key == near.key; };
    const auto found = std::find_if(slots_.begin(), slots_.end(), is_same);
    if (found != slots_.end()) near.slot = &*found;
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
  for (Slot& slot : slots_) slot.is_near = false;
  for (Near& near : near_) {
    if (near.slot != nullptr) near.slot->is_near = true;
  }
  for (Slot& slot : slots_) {
    slot.is_used = slot.is_used && slot.is_near;
    slot.deepest_m = 0;
  }
  for (Near& near : near_) {
    if (near.slot != nullptr) continue;
    // There are as many slots as near pairs at most.
    const auto free = std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) { return !slot.is_used; });
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
  bodies_.push_back({rigid.mass().mass_kg, rigid.inertia_W(), rigid.centre_W(), rigid.velocity_of_centre_W(),
                     things[thing].wrench_W});
}

TickFaults TouchStage::find_contacts(std::span<const TouchThing> things) noexcept {
  TickFaults faults = 0;
  for (const Near& near : near_) {
    const TouchThing& a = things[near.key.thing_a];
    const TouchThing& b = things[near.key.thing_b];
    const Pose X_WA = a.rigid->state().X * a.model->parts[near.key.part_a].X_BS;
    const Pose X_WB = b.rigid->state().X * b.model->parts[near.key.part_b].X_BS;
    const ContactWork work = near.slot->pair.find(X_WA, X_WB, near.band_m);
    if (work.is_coarse) faults |= kFaultContactCoarse;
    if (!near.slot->pair.contacts().empty()) add_patch(things, near);
  }
  return faults;
}

void TouchStage::add_patch(std::span<const TouchThing> things, const Near& near) noexcept {
  const TouchThing& a = things[near.key.thing_a];
  const TouchThing& b = things[near.key.thing_b];
  if (b.role == TouchThing::Role::kGuest && body_of_thing_[near.key.thing_b] == kStaticBody) {
    add_body(things, near.key.thing_b);
  }
  SolverPatch patch;
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

TickFaults TouchStage::solve(double step_s, std::span<TouchPull> pulls) noexcept {
  couplings_.clear();
  for (const TouchPull& pull : pulls) {
    couplings_.push_back(pull.hand->coupling(body_of_thing_[pull.thing], pull.X_WT));
  }
  const std::span wrenches(tool_wrenches_.data(), pulls.size());
  const std::span results(results_.data(), patches_.size());
  const SolverReport report = solver_.step(step_s, bodies_, couplings_, patches_, results, wrenches);
  for (std::size_t i = 0; i < pulls.size(); ++i) pulls[i].wrench_W = wrenches[i];
  TickFaults faults = 0;
  if (!report.has_converged) faults |= kFaultContactUnsolved;
  if (report.left_out > report.ill_formed) faults |= kFaultContactCoarse;
  if (report.ill_formed > 0) faults |= kFaultNotFinite;
  return faults;
}

/// From led things outwards, until nothing is added: chains are short.
void TouchStage::find_reached(std::span<const TouchThing> things) noexcept {
  for (std::size_t i = 0; i < things.size(); ++i) {
    felt_[i].is_reached = things[i].role == TouchThing::Role::kOurs && things[i].is_led;
  }
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      if (results_[i].pressing == 0) continue;
      TouchContact& a = felt_[patch_slots_[i]->key.thing_a];
      TouchContact& b = felt_[patch_slots_[i]->key.thing_b];
      const bool is_passed_on = a.is_reached != b.is_reached &&
                                things[patch_slots_[i]->key.thing_a].role != TouchThing::Role::kStatic &&
                                things[patch_slots_[i]->key.thing_b].role != TouchThing::Role::kStatic;
      if (is_passed_on) a.is_reached = b.is_reached = has_grown = true;
    }
  }
}

TickFaults TouchStage::write_back(double step_s, std::span<TouchThing> things) noexcept {
  TickFaults faults = 0;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const auto feel = [&](std::size_t thing, const Wrench& wrench) {
      felt_[thing].pressing += results_[i].pressing;
      felt_[thing].deepest_m = std::max(felt_[thing].deepest_m, results_[i].deepest_m);
      felt_[thing].wrench_W += wrench;
    };
    feel(patch_slots_[i]->key.thing_a, results_[i].on_a_W);
    feel(patch_slots_[i]->key.thing_b, -results_[i].on_a_W);
    patch_slots_[i]->deepest_m = results_[i].deepest_m;
  }
  find_reached(things);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    TouchThing& thing = things[thing_of_body_[i]];
    if (thing.role == TouchThing::Role::kOurs) {
      if (limit_motion(bodies_[i].V_WC, 2 * thing.model->radius_m, limits_)) faults |= kFaultSpeedLimited;
      thing.rigid->advance(bodies_[i].V_WC, step_s);
    } else {
      thing.rigid->apply_wrench(felt_[thing_of_body_[i]].wrench_W, Vec3::Zero());
    }
  }
  return faults;
}

}  // namespace tandem
