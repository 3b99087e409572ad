#include "server/effect_stage.hpp"

#include <algorithm>

namespace tandem {
namespace {

bool can_move(const TouchThing& thing) {
  return thing.role == TouchThing::Role::kOurs || thing.role == TouchThing::Role::kGuest;
}

/// Largest sum of a row: not less than the largest eigenvalue of a symmetric matrix, and that itself for a free ball.
double bound_of(const Eigen::Matrix3d& matrix) {
  return matrix.cwiseAbs().rowwise().sum().maxCoeff();
}

/// How a thing gives way: to a force at a point, and to a torque.
struct Mobility {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Zero();   ///< [1/kg]
  Eigen::Matrix3d angular = Eigen::Matrix3d::Zero();  ///< [1/(kg m²)]
};

Mobility mobility_at(const TouchThing& thing, const Vec3& p_W) {
  if (!can_move(thing)) return {};
  const Vec3 r = p_W - thing.rigid->centre_W();
  Eigen::Matrix3d cross;
  cross << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  const Eigen::Matrix3d inverse_inertia = thing.rigid->inertia_W().inverse();
  const Eigen::Matrix3d linear = Eigen::Matrix3d::Identity() / thing.rigid->mass().mass_kg;
  return {linear + cross.transpose() * inverse_inertia * cross, inverse_inertia};
}

}  // namespace

EffectStage::EffectStage(std::span<const SceneEffect> effects, std::size_t things, std::size_t tools)
    : memories_(effects.size() * tools), velocities_(things) {
  for (const SceneEffect& effect : effects) effects_.push_back({Effect(effect.settings), effect.body});
}

void EffectStage::forget(std::size_t tool) noexcept {
  const auto first = memories_.begin() + static_cast<std::ptrdiff_t>(tool * effects_.size());
  std::fill_n(first, effects_.size(), EffectMemory{});
}

void EffectStage::apply(double time_s, double step_s, std::span<TouchThing> things, std::span<const EffectTool> tools,
                        const TouchStage& touch) noexcept {
  for (std::size_t i = 0; i < things.size(); ++i) {
    velocities_[i] = can_move(things[i]) ? things[i].rigid->velocity_of_centre_W() : Twist{};
  }
  for (const EffectTool& tool : tools) {
    for (std::size_t i = 0; i < effects_.size(); ++i) {
      apply_one(time_s, step_s, effects_[i], things, tool, memories_[tool.tool * effects_.size() + i], touch);
    }
  }
}

void EffectStage::apply_one(double time_s, double step_s, const Owned& owned, std::span<TouchThing> things,
                            const EffectTool& tool, EffectMemory& memory, const TouchStage& touch) noexcept {
  if (owned.body == tool.thing) {
    memory = EffectMemory{};
    return;
  }
  const Vec3& p_WT = tool.X_WT.p;
  const auto velocity_at = [&](std::size_t thing) {
    const Twist& V = velocities_[thing];
    return Twist{V.v + V.w.cross(p_WT - things[thing].rigid->centre_W()), V.w};
  };
  const Twist V_WT = velocity_at(tool.thing);
  Mobility mobility = mobility_at(things[tool.thing], p_WT);
  Pose X_WO;
  Twist V_WO;
  TouchBetween between;
  if (owned.body) {
    const TouchThing& owner = things[*owned.body];
    const Mobility of_owner = mobility_at(owner, p_WT);
    mobility.linear += of_owner.linear;
    mobility.angular += of_owner.angular;
    X_WO = owner.rigid->state().X;
    if (can_move(owner)) V_WO = velocity_at(*owned.body);
    between = touch.between(tool.thing, *owned.body);
  }
  const Quat q_OW = X_WO.q.conjugate();
  const EffectInput input{time_s,
                          step_s,
                          q_OW * (p_WT - X_WO.p),
                          {q_OW * (V_WT.v - V_WO.v), q_OW * (V_WT.w - V_WO.w)},
                          1 / bound_of(mobility.linear),
                          1 / bound_of(mobility.angular),
                          between.normal_force_n,
                          q_OW * between.normal_W};
  const Wrench on_tool_O = owned.effect.wrench_on_tool_O(input, memory);
  const Wrench on_tool_W{X_WO.q * on_tool_O.f, X_WO.q * on_tool_O.t};
  push(step_s, things[tool.thing], tool.thing, on_tool_W, p_WT);
  if (owned.body) push(step_s, things[*owned.body], *owned.body, -on_tool_W, p_WT);
}

void EffectStage::push(double step_s, TouchThing& thing, std::size_t index, const Wrench& wrench_W,
                       const Vec3& p_W) noexcept {
  if (!can_move(thing)) return;
  const Vec3 lever = p_W - thing.rigid->centre_W();
  const Wrench about_centre_W{wrench_W.f, wrench_W.t + lever.cross(wrench_W.f)};
  thing.wrench_W += about_centre_W;
  if (thing.role == TouchThing::Role::kGuest) thing.rigid->apply_wrench(wrench_W, p_W);
  velocities_[index].v += step_s / thing.rigid->mass().mass_kg * about_centre_W.f;
  velocities_[index].w += step_s * thing.rigid->inertia_W().inverse() * about_centre_W.t;
}

}  // namespace tandem
