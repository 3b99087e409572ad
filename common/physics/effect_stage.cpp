#include "common/physics/effect_stage.hpp"

#include <algorithm>

namespace tandem::physics {
namespace {

/// Limit of a fluid's damping around a massless tool, as a fraction of m/h, where m is the mass of the body that owns
/// the fluid, and h is the step. The drag on the tool acts back on that body one step late. A stronger late reaction
/// could reverse the body's motion.
constexpr double kLateShare = 0.25;

bool can_move(const TouchThing& thing) {
  return thing.role == TouchThing::Role::kImplicit || thing.role == TouchThing::Role::kExternal;
}

bool is_massless(const TouchThing& thing) {
  return thing.dynamics == haptics::ToolDynamics::kMassless;
}

/// Returns the largest row sum of absolute values: an upper bound of the largest eigenvalue of a symmetric matrix. For
/// a ball that can move freely, the matrix is a multiple of the identity, and the bound is exact.
double bound_of(const Eigen::Matrix3d& matrix) {
  return matrix.cwiseAbs().rowwise().sum().maxCoeff();
}

/// Mobility of an object: acceleration per force at a point, and angular acceleration per torque.
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

/// Returns the mobility of a massless tool with the coupling stiffness k. A force f displaces the tool by f/k in a step
/// of the length h. A mass of k h² would be displaced equally, so the tool has the mobility 1/(k h²).
Mobility mobility_of(const Joint& tether, double step_s) {
  constexpr double kLeast = 1e-9;  // lower limit, used if a stiffness is zero
  const double squared = step_s * step_s;
  return {Eigen::Matrix3d::Identity() / std::max(kLeast, tether.stiffness_n_per_m * squared),
          Eigen::Matrix3d::Identity() / std::max(kLeast, tether.stiffness_n_m_per_rad * squared)};
}

/// Returns the velocity of the object's point at `p_W`, given the velocity of the object's centre.
Twist velocity_at(const Twist& V_WC, const TouchThing& thing, const Vec3& p_W) {
  return {V_WC.v + V_WC.w.cross(p_W - thing.rigid->centre_W()), V_WC.w};
}

Wrench scaled(const Wrench& wrench, double factor) {
  return {factor * wrench.f, factor * wrench.t};
}

}  // namespace

struct EffectStage::Meeting {
  const Effect& effect;
  const TouchCoupling& tool;
  Pose X_WO;
  Twist V_WT;         ///< velocity of the tool's origin
  Twist V_WO;         ///< velocity of the owner's point at the position of the tool's origin
  Mobility of_owner;  ///< mobility of the owner at that point; zero if it cannot move
};

EffectStage::EffectStage(std::span<const EffectSettings> effects, std::size_t things, std::size_t tools)
    : memories_(effects.size() * tools), flows_(effects.size() * tools), hands_(things), velocities_(things) {
  for (const EffectSettings& effect : effects) effects_.emplace_back(effect);
}

void EffectStage::forget(std::size_t tool) noexcept {
  const auto first = static_cast<std::ptrdiff_t>(tool * effects_.size());
  std::fill_n(memories_.begin() + first, effects_.size(), EffectMemory{});
  std::fill_n(flows_.begin() + first, effects_.size(), TouchDrag{});
}

void EffectStage::apply(double time_s, double step_s, std::span<TouchThing> things,
                        std::span<const TouchCoupling> tools, const TouchStage& touch) noexcept {
  for (std::size_t i = 0; i < things.size(); ++i) {
    velocities_[i] = can_move(things[i]) ? things[i].rigid->velocity_of_centre_W() : Twist{};
    if (is_massless(things[i])) velocities_[i] = touch.contact(i).V_WC;
  }
  std::fill(hands_.begin(), hands_.end(), 0);
  for (const TouchCoupling& tool : tools) ++hands_[tool.thing];
  for (const TouchCoupling& tool : tools) {
    for (std::size_t i = 0; i < effects_.size(); ++i) apply_one(time_s, step_s, i, things, tool, touch);
  }
}

void EffectStage::apply_one(double time_s, double step_s, std::size_t index, std::span<TouchThing> things,
                            const TouchCoupling& tool, const TouchStage& touch) noexcept {
  const Effect& effect = effects_[index];
  const std::optional<std::size_t> owner = effect.settings().owner;
  EffectMemory& memory = memories_[tool.tool * effects_.size() + index];
  TouchDrag& flow = flows_[tool.tool * effects_.size() + index];
  if (owner == tool.thing) {
    memory = EffectMemory{};
    flow = TouchDrag{};
    return;
  }
  const Vec3& p_WT = tool.X_WT.p;
  const bool has_no_mass = is_massless(things[tool.thing]);
  Meeting meeting{effect, tool, {}, velocity_at(velocities_[tool.thing], things[tool.thing], p_WT), {}, {}};
  TouchBetween between;
  if (owner) {
    const TouchThing& thing = things[*owner];
    meeting.of_owner = mobility_at(thing, p_WT);
    meeting.X_WO = thing.rigid->pose();
    if (can_move(thing)) meeting.V_WO = velocity_at(velocities_[*owner], thing, p_WT);
    between = touch.between(tool.thing, *owner);
  }
  const Mobility own =
      has_no_mass ? mobility_of(tool.hand->tether(tool.X_WT), step_s) : mobility_at(things[tool.thing], p_WT);
  const Quat q_OW = meeting.X_WO.q.conjugate();
  const EffectInput input{time_s,
                          step_s,
                          q_OW * (p_WT - meeting.X_WO.p),
                          {q_OW * (meeting.V_WT.v - meeting.V_WO.v), q_OW * (meeting.V_WT.w - meeting.V_WO.w)},
                          1 / bound_of(own.linear + meeting.of_owner.linear),
                          1 / bound_of(own.angular + meeting.of_owner.angular),
                          between.normal_force_n,
                          q_OW * between.normal_W,
                          has_no_mass};
  if (has_no_mass && effect.is_viscous()) return flow_round(meeting, input, things, flow);
  flow = TouchDrag{};
  const Wrench on_tool_O = effect.wrench_on_tool_O(input, memory);
  const Wrench on_tool_W =
      scaled({meeting.X_WO.q * on_tool_O.f, meeting.X_WO.q * on_tool_O.t}, 1.0 / hands_[tool.thing]);
  push(step_s, things[tool.thing], tool.thing, on_tool_W, p_WT);
  if (owner) push(step_s, things[*owner], *owner, -on_tool_W, p_WT);
}

/// Handles a fluid around a massless tool. Applies to the fluid's owner the reaction to the drag of the last step. Then
/// computes the fluid for this step; its drag is known only after the solution.
void EffectStage::flow_round(const Meeting& meeting, const EffectInput& input, std::span<TouchThing> things,
                             TouchDrag& flow) noexcept {
  const EffectSettings& settings = meeting.effect.settings();
  if (settings.owner) {
    const Wrench on_owner_W{
        clamped_to_length(flow.fluid.damping_n_s_per_m * (meeting.V_WT.v - flow.V_W.v), settings.force_limit_n),
        clamped_to_length(flow.fluid.damping_n_m_s_per_rad * (meeting.V_WT.w - flow.V_W.w), settings.torque_limit_n_m)};
    push(input.step_s, things[*settings.owner], *settings.owner, on_owner_W, meeting.tool.X_WT.p);
  }
  flow = {meeting.effect.damping(input), meeting.V_WO, settings.force_limit_n, settings.torque_limit_n_m};
  const double linear = bound_of(meeting.of_owner.linear), angular = bound_of(meeting.of_owner.angular);
  if (linear > 0)
    flow.fluid.damping_n_s_per_m = std::min(flow.fluid.damping_n_s_per_m, kLateShare / (linear * input.step_s));
  if (angular > 0) {
    flow.fluid.damping_n_m_s_per_rad =
        std::min(flow.fluid.damping_n_m_s_per_rad, kLateShare / (angular * input.step_s));
  }
  if (flow.is_acting()) things[meeting.tool.thing].drag.add(flow);
}

void EffectStage::push(double step_s, TouchThing& thing, std::size_t index, const Wrench& wrench_W,
                       const Vec3& p_W) noexcept {
  if (!can_move(thing)) return;
  const Vec3 lever = p_W - thing.rigid->centre_W();
  const Wrench about_centre_W{wrench_W.f, wrench_W.t + lever.cross(wrench_W.f)};
  thing.wrench_W += about_centre_W;
  if (thing.role == TouchThing::Role::kExternal) thing.rigid->apply_wrench(wrench_W, p_W);
  if (is_massless(thing)) return;
  velocities_[index].v += step_s / thing.rigid->mass().mass_kg * about_centre_W.f;
  velocities_[index].w += step_s * thing.rigid->inertia_W().inverse() * about_centre_W.t;
}

}  // namespace tandem::physics
