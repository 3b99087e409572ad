#include "common/physics/untouched_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/physics/touch/touch_limits.hpp"

namespace tandem::physics {
namespace {

/// A body is at rest if it was slower than both speed limits for kRest_s.
constexpr double kRest_m_per_s = 2e-5, kRest_rad_per_s = 5e-4, kRest_s = 0.5;
/// Smallest speed of impact that bounces. A body at rest on another one stays below it, because gravity adds only 0.01
/// m/s in a step.
constexpr double kBounce_m_per_s = 0.05;

/// Returns the twist about the origin of W, the reference point of contact wrenches.
Twist twist_at_origin(const RigidBody& body) {
  const Twist& V = body.velocity_of_centre_W();
  return {V.v - V.w.cross(body.centre_W()), V.w};
}

double power_w(const Wrench& on_a_W, const Twist& a, const Twist& b) {
  return on_a_W.f.dot(a.v - b.v) + on_a_W.t.dot(a.w - b.w);
}

/// Returns the mobility of the body in the direction of `wrench_W`: the power of the wrench with the acceleration that
/// it causes. It is 0 for a static body.
double yield_of(const RigidBody& body, const Wrench& wrench_W) {
  if (body.is_static()) return 0;
  const Wrench at_centre_W{wrench_W.f, wrench_W.t - body.centre_W().cross(wrench_W.f)};
  const Twist a = body.acceleration_W(at_centre_W);
  return at_centre_W.f.dot(a.v) + at_centre_W.t.dot(a.w);
}

class UntouchedBodies final : public FreeBodies {
 public:
  explicit UntouchedBodies(const WorldDescription& world);

  void add(std::size_t index, RigidBody& rigid) override;
  void remove(std::size_t index) override;
  void set_gravity(const Vec3& m_per_s2) noexcept override;
  TickFaults step(double step_s) noexcept override;

 private:
  struct Body {
    const BodyDescription* description = nullptr;
    JointLaw anchor = {};
    RigidBody* rigid = nullptr;  ///< null: another component steps the body
    RigidState last = {};        ///< state after the last step
    Twist before = {};           ///< twist about the origin of W before the step
    double still_s = 0;
    std::size_t group = 0;  ///< lowest index of the bodies in its group
    bool is_asleep = false;

    bool is_free() const { return rigid != nullptr && !rigid->is_static(); }
    bool is_awake() const { return is_free() && !is_asleep; }
    bool is_disturbed() const;
    RigidState now() const { return {rigid->centre_pose(), rigid->velocity_of_centre_W()}; }
  };
  /// State of an impact between two bodies, from their first contact to the end of the compression phase.
  struct Impact {
    std::size_t a = 0, b = 0;
    double met_m_per_s = 0;  ///< speed of approach before the contact; 0: too slow to bounce
    Wrench impulse_on_a_W = {};
    /// True until the end of the first step with contact. The contact forces of that step determine the speed of
    /// approach.
    bool is_new = true;
    bool is_pressing = false;
    bool is_over = false;
  };

  void wake(std::size_t index);
  void wake_group(std::size_t index);
  void wake_all();
  void wake_disturbed();
  void describe();
  bool is_any_awake() const;
  void join_groups();
  void rest(double step_s);
  void follow_impacts(double step_s);
  void press(std::size_t a, std::size_t b, const contact::PatchResult& result, double step_s);
  double speed_of_approach(const Impact& impact) const;
  void bounce(Impact& impact, double step_s);
  double restitution(std::size_t a, std::size_t b) const;

  Vec3 gravity_m_per_s2_;
  bool has_restitution_ = false;
  std::vector<Body> bodies_;
  std::vector<TouchThing> things_;
  std::vector<TouchJoint> joints_;
  std::vector<Impact> impacts_;
  TouchStage touch_;
};

UntouchedBodies::UntouchedBodies(const WorldDescription& world)
    : gravity_m_per_s2_(world.gravity_m_per_s2),
      bodies_(world.bodies.size()),
      things_(world.bodies.size()),
      touch_(touch_limits(world, {})) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const BodyDescription& description = world.bodies[i];
    bodies_[i].description = &description;
    bodies_[i].group = i;
    if (description.anchor) bodies_[i].anchor.set(*description.anchor);
    has_restitution_ = has_restitution_ || description.traits.restitution > 0;
  }
  joints_.reserve(bodies_.size());
  if (has_restitution_) impacts_.reserve(touch_limits(world, {}).pairs);
}

bool UntouchedBodies::Body::is_disturbed() const {
  const Wrench& applied = rigid->applied_W();
  return !applied.f.isZero(0) || !applied.t.isZero(0) || !is_same(last, now());
}

void UntouchedBodies::add(std::size_t index, RigidBody& rigid) {
  bodies_[index].rigid = &rigid;
  bodies_[index].group = index;
  wake(index);
}

/// Removes a body and wakes the bodies that touch it. All members of its group are woken. A static body belongs to no
/// group, so its removal wakes all bodies.
void UntouchedBodies::remove(std::size_t index) {
  if (bodies_[index].rigid->is_static()) {
    wake_all();
  } else {
    wake_group(index);
  }
  bodies_[index].rigid = nullptr;
}

void UntouchedBodies::set_gravity(const Vec3& m_per_s2) noexcept {
  gravity_m_per_s2_ = m_per_s2;
  wake_all();
}

void UntouchedBodies::wake_all() {
  for (std::size_t i = 0; i < bodies_.size(); ++i) wake(i);
}

void UntouchedBodies::wake(std::size_t index) {
  bodies_[index].is_asleep = false;
  bodies_[index].still_s = 0;
}

void UntouchedBodies::wake_group(std::size_t index) {
  const std::size_t group = bodies_[index].group;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].group == group) wake(i);
  }
}

void UntouchedBodies::wake_disturbed() {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].is_free() && bodies_[i].is_asleep && bodies_[i].is_disturbed()) wake_group(i);
  }
}

bool UntouchedBodies::is_any_awake() const {
  return std::ranges::any_of(bodies_, [](const Body& body) { return body.is_awake(); });
}

TickFaults UntouchedBodies::step(double step_s) noexcept {
  wake_disturbed();
  if (!is_any_awake()) return 0;
  describe();
  const TickFaults faults = touch_.step(step_s, things_, {}, joints_);
  if (has_restitution_) follow_impacts(step_s);
  join_groups();
  rest(step_s);
  return faults;
}

void UntouchedBodies::describe() {
  using Role = TouchThing::Role;
  joints_.clear();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    TouchThing& thing = things_[i];
    thing = {body.rigid, &body.description->touch, Role::kAbsent, false, 0};
    if (body.rigid == nullptr) continue;
    // A sleeping body takes part in the solution with its inertia, as an external body. Its weight is omitted, because
    // the body on which it rests carries it. If an awake body touches the sleeping one, the contact wrench wakes it.
    thing.role = body.rigid->is_static() ? Role::kStatic : body.is_asleep ? Role::kExternal : Role::kImplicit;
    if (has_restitution_ && !body.rigid->is_static()) body.before = twist_at_origin(*body.rigid);
    if (!body.is_awake()) continue;
    thing.wrench_W = body.rigid->weight_W(gravity_m_per_s2_) + body.rigid->applied_W();
    if (!body.description->anchor) continue;
    joints_.push_back({i, &body.anchor, {body.description->X_WB, Twist{}}, body.rigid->pose()});
  }
}

/// Groups the bodies that are in contact. The number of a group is the lowest index of the bodies in it.
void UntouchedBodies::join_groups() {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].is_awake()) bodies_[i].group = i;
  }
  touch_.for_each_pressing([this](std::size_t a, std::size_t b, const contact::PatchResult&) {
    if (!bodies_[a].is_awake() || !bodies_[b].is_awake()) return;
    const auto [low, high] = std::minmax(bodies_[a].group, bodies_[b].group);
    const std::size_t kept = low, joined = high;
    for (Body& body : bodies_) {
      if (body.is_awake() && body.group == joined) body.group = kept;
    }
  });
}

void UntouchedBodies::rest(double step_s) {
  for (Body& body : bodies_) {
    if (!body.is_awake()) continue;
    const Twist& V = body.rigid->velocity_of_centre_W();
    const bool is_still = V.v.norm() < kRest_m_per_s && V.w.norm() < kRest_rad_per_s;
    body.still_s = is_still ? body.still_s + step_s : 0;
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (!bodies_[i].is_awake() || bodies_[i].group != i) continue;
    const auto is_restless = [i](const Body& body) {
      return body.is_awake() && body.group == i && body.still_s < kRest_s;
    };
    if (std::ranges::any_of(bodies_, is_restless)) continue;
    for (Body& body : bodies_) {
      if (!body.is_awake() || body.group != i) continue;
      body.is_asleep = true;
      body.rigid->set_centre(body.rigid->centre_pose(), Twist{});
    }
  }
  for (Body& body : bodies_) {
    if (body.is_free()) body.last = body.now();
  }
}

double UntouchedBodies::restitution(std::size_t a, std::size_t b) const {
  return std::max(bodies_[a].description->traits.restitution, bodies_[b].description->traits.restitution);
}

void UntouchedBodies::follow_impacts(double step_s) {
  for (Impact& impact : impacts_) impact.is_pressing = false;
  touch_.for_each_pressing([this, step_s](std::size_t a, std::size_t b, const contact::PatchResult& result) {
    press(a, b, result, step_s);
  });
  std::erase_if(impacts_, [](const Impact& impact) { return !impact.is_pressing; });
  for (Impact& impact : impacts_) {
    if (std::exchange(impact.is_new, false)) impact.met_m_per_s = speed_of_approach(impact);
    bounce(impact, step_s);
  }
}

/// Returns the speed of approach along the direction of the pair's total impulse; 0 if it is too slow for a bounce.
double UntouchedBodies::speed_of_approach(const Impact& impact) const {
  const Wrench& impulse_W = impact.impulse_on_a_W;
  const double size = impulse_W.f.norm();
  if (!(size > 0)) return 0;
  const double closing = -power_w(impulse_W, bodies_[impact.a].before, bodies_[impact.b].before) / size;
  return closing > kBounce_m_per_s ? closing : 0;
}

void UntouchedBodies::press(std::size_t a, std::size_t b, const contact::PatchResult& result, double step_s) {
  if (restitution(a, b) <= 0) return;
  // Search for the pair in both orders: the order of its bodies changes when one of them wakes.
  const auto is_its = [a, b](const Impact& impact) {
    return (impact.a == a && impact.b == b) || (impact.a == b && impact.b == a);
  };
  auto impact = std::ranges::find_if(impacts_, is_its);
  if (impact == impacts_.end()) {
    if (impacts_.size() == impacts_.capacity()) return;
    impacts_.push_back({a, b});
    impact = std::prev(impacts_.end());
  }
  impact->is_pressing = true;
  const double sign = impact->a == a ? 1 : -1;
  if (!impact->is_over) impact->impulse_on_a_W += result.on_a_W * (sign * step_s);
}

/// If the compression of the impact has ended, applies the impulse that makes the bodies separate at the required
/// speed. The impulse takes effect in the next step.
void UntouchedBodies::bounce(Impact& impact, double step_s) {
  const Wrench& impulse_W = impact.impulse_on_a_W;
  const double size = impulse_W.f.norm();
  if (impact.is_over || impact.met_m_per_s <= 0 || !(size > 0)) return;
  RigidBody& a = *bodies_[impact.a].rigid;
  RigidBody& b = *bodies_[impact.b].rigid;
  const double parting = power_w(impulse_W, twist_at_origin(a), twist_at_origin(b)) / size;
  const double wanted = restitution(impact.a, impact.b) * impact.met_m_per_s;
  // The compression has not ended while the bodies approach faster than half of kBounce_m_per_s.
  if (parting < -kBounce_m_per_s / 2) return;
  impact.is_over = true;
  const double yield = yield_of(a, impulse_W) + yield_of(b, impulse_W);
  if (parting >= wanted || !(yield > 0)) return;
  const double share = (wanted - parting) * size / yield;
  const Wrench push_W = impulse_W * (share / step_s);
  if (!a.is_static()) a.apply_wrench(push_W, Vec3::Zero());
  if (!b.is_static()) b.apply_wrench(-push_W, Vec3::Zero());
}

}  // namespace

std::unique_ptr<FreeBodies> make_untouched_bodies(const WorldDescription& world) {
  return std::make_unique<UntouchedBodies>(world);
}

}  // namespace tandem::physics
