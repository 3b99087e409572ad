#include "common/physics/touch/inertialess_things.hpp"

#include <algorithm>

#include "common/haptics/coupling/saturation.hpp"

namespace tandem::physics {
namespace {

/// Regularisation of a massless tool: in the solver, the tool has a small inertia. This constant is the resistance of
/// the inertia within a step, as a fraction of the spring's resistance. The relative error of the tool's final pose is
/// about this fraction. It was chosen to bound the condition number of the solver's matrix.
constexpr double kRegularisation = 1e-4;
/// Minimum mass of the regularisation, for a massless tool without a spring. Moving this mass by 1 mm in a step of 1 ms
/// needs only 1e-6 N.
constexpr double kMinRegularisation_kg = 1e-9;
/// Minimum radius of gyration of the regularisation; equal to kToolGyrationRadius_m.
constexpr double kGyration_m = 0.015;

/// Returns the twist of the object's centre with which the tool frame T reaches the handle's pose within a step.
Twist twist_to_handle(const Pose& X_WH, const Pose& X_WT, const Vec3& p_WC, double step_s) {
  const Vec3 turn = rotation_vector(X_WH.q * X_WT.q.conjugate());
  const Vec3 p_WC_then = X_WH.p - quaternion_of(turn) * (X_WT.p - p_WC);
  return {(p_WC_then - p_WC) / step_s, turn / step_s};
}

}  // namespace

/// Motion of an object without inertia, computed from its couplings and joints.
struct InertialessThings::Motion {
  int hands = 0;
  Twist V_WC;                ///< prescribed twist of an object at its handle
  double mass_kg = 0;        ///< mass that replaces the inertia of a massless object (regularisation)
  double inertia_kg_m2 = 0;  ///< moment of inertia of the regularisation
  double reach_m = 0;
  Vec3 lever_W = Vec3::Zero();  ///< vector from the centre to the tool's origin, for an object with one hand
};

InertialessThings::InertialessThings(std::size_t things, std::size_t tools, double speed_m_per_s)
    : speed_m_per_s_(speed_m_per_s), motions_(things) {
  for (std::size_t i = 0; i < tools; ++i) drag_laws_.push_back(haptics::make_coupling_law("spring-damper", {}));
}

InertialessThings::~InertialessThings() = default;

TickFaults InertialessThings::follow(double step_s, std::span<const TouchThing> things,
                                     std::span<const TouchCoupling> couplings,
                                     std::span<const TouchJoint> joints) noexcept {
  TickFaults faults = 0;
  if (std::all_of(things.begin(), things.end(), [](const TouchThing& thing) { return thing.has_inertia(); })) return 0;
  std::fill(motions_.begin(), motions_.end(), Motion{});
  for (const TouchCoupling& coupling : couplings) ++motions_[coupling.thing].hands;
  for (const TouchCoupling& coupling : couplings) {
    add_coupling(step_s, things[coupling.thing], coupling, motions_[coupling.thing]);
  }
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].role != TouchThing::Role::kImplicit || things[i].has_inertia()) continue;
    Motion& motion = motions_[i];
    const bool is_slowed = limit_motion(motion.V_WC, 2 * things[i].model->radius_m, speed_m_per_s_);
    if (is_slowed && things[i].is_at_handle()) faults |= kFaultSpeedLimited;
    motion.mass_kg = std::max(motion.mass_kg, kMinRegularisation_kg);
    motion.inertia_kg_m2 = std::max(motion.inertia_kg_m2, motion.mass_kg * kGyration_m * kGyration_m);
  }
  for (const TouchJoint& joint : joints) {
    if (things[joint.thing].is_massless()) add_joint(step_s, things[joint.thing], joint, motions_[joint.thing]);
  }
  return faults;
}

void InertialessThings::add_coupling(double step_s, const TouchThing& thing, const TouchCoupling& coupling,
                                     Motion& motion) noexcept {
  const Vec3 p_WC = thing.rigid->centre_W();
  const Twist V_WC = twist_to_handle(coupling.hand->target_pose(), coupling.X_WT, p_WC, step_s);
  // If several hands hold the object, its motion is the mean of the motions to their handles.
  motion.V_WC.v += V_WC.v / motion.hands;
  motion.V_WC.w += V_WC.w / motion.hands;
  // The factor 2 allows for sliding: a massless tool may slide along an obstacle as far as its distance to the handle,
  // while its distance to the handle does not decrease.
  motion.reach_m += 2 * step_s * (V_WC.v.norm() + 2 * thing.model->radius_m * V_WC.w.norm());
  motion.lever_W = coupling.X_WT.p - p_WC;
  const haptics::CouplingParameters& spring = coupling.hand->parameters();
  const double squared = kRegularisation * step_s * step_s;
  motion.mass_kg += squared * spring.stiffness_n_per_m;
  motion.inertia_kg_m2 += squared * spring.stiffness_n_m_per_rad;
}

/// Adds the motion that a joint causes on a massless object.
void InertialessThings::add_joint(double step_s, const TouchThing& thing, const TouchJoint& joint,
                                  Motion& motion) noexcept {
  const Vec3 p_WC = thing.rigid->centre_W();
  const Twist V_WC = twist_to_handle(joint.target.X, joint.X_WT, p_WC, step_s);
  const Twist& V = joint.target.V;
  motion.reach_m +=
      2 * step_s * (V_WC.v.norm() + V.v.norm() + 2 * thing.model->radius_m * (V_WC.w.norm() + V.w.norm()));
  if (motion.hands == 0) motion.lever_W = joint.X_WT.p - p_WC;
  const double squared = kRegularisation * step_s * step_s;
  motion.mass_kg = std::max(motion.mass_kg, squared * joint.law->joint().stiffness_n_per_m);
  motion.inertia_kg_m2 = std::max(motion.inertia_kg_m2, squared * joint.law->joint().stiffness_n_m_per_rad);
}

/// Returns the upper limit of the object's motion in a step: the sum of the motions by its couplings and joints, by
/// external wrenches, which stretch the springs, and by a moving fluid.
double InertialessThings::reach_m(double step_s, const TouchThing& thing, std::size_t index) const noexcept {
  const Motion& motion = motions_[index];
  const Vec3& f = thing.wrench_W.f;
  const Vec3 about_tool_W = thing.wrench_W.t - motion.lever_W.cross(f);
  // The factor 2 allows for a nonlinear law, whose spring may stretch more than its initial slope predicts.
  const double squared = 2 * kRegularisation * step_s * step_s;
  const double moved_m = squared * f.norm() / motion.mass_kg;
  const double turned_rad = squared * about_tool_W.norm() / motion.inertia_kg_m2;
  const double carried_m = thing.drag.is_acting() ? step_s * thing.drag.V_W.v.norm() : 0;
  const double carried_rad = thing.drag.is_acting() ? step_s * thing.drag.V_W.w.norm() : 0;
  const double reach_m = motion.reach_m + moved_m + carried_m + 2 * thing.model->radius_m * (turned_rad + carried_rad);
  return std::min(reach_m, step_s * speed_m_per_s_);
}

void InertialessThings::describe(const TouchThing& thing, std::size_t index, contact::SolverBody& body) const noexcept {
  const Motion& motion = motions_[index];
  if (thing.is_at_handle()) {
    body.V_WC = motion.V_WC;
    body.is_prescribed = true;
    return;
  }
  body.mass_kg = motion.mass_kg;
  body.inertia_W = motion.inertia_kg_m2 * Eigen::Matrix3d::Identity();
  body.V_WC = {Vec3::Zero(), Vec3::Zero()};
}

void InertialessThings::add_drags(std::span<const TouchThing> things, std::span<const int> body_of_thing,
                                  std::vector<contact::SolverCoupling>& couplings) noexcept {
  std::size_t drags = 0;
  for (std::size_t i = 0; i < things.size() && drags < drag_laws_.size(); ++i) {
    const TouchDrag& drag = things[i].drag;
    if (!things[i].is_massless() || body_of_thing[i] == contact::kStaticBody || !drag.is_acting()) continue;
    haptics::CouplingLaw& law = *drag_laws_[drags++];
    law.set_parameters({0, drag.fluid.damping_n_s_per_m, 0, drag.fluid.damping_n_m_s_per_rad, drag.force_limit_n,
                        drag.torque_limit_n_m, 0, 1});
    const Pose X_W = things[i].rigid->pose();
    couplings.push_back({body_of_thing[i], &law, X_W, drag.V_W, X_W});
  }
}

/// Computes the wrenches of hands and joints on objects at their handle. Such an object is not part of the solution.
/// Its hands carry the contact load on it, up to the limits of their couplings.
void InertialessThings::show_contacts(double step_s, std::span<const TouchThing> things,
                                      std::span<const TouchContact> felt, std::span<TouchCoupling> couplings,
                                      std::span<TouchJoint> joints) const noexcept {
  for (TouchJoint& joint : joints) {
    const TouchThing& thing = things[joint.thing];
    if (thing.role != TouchThing::Role::kImplicit || !thing.is_at_handle()) continue;
    const Twist& V_WC = motions_[joint.thing].V_WC;
    const Vec3 p_WC = thing.rigid->centre_W();
    const Vec3 lever_W = quaternion_of(V_WC.w * step_s) * (joint.X_WT.p - p_WC);
    const Pose X_WT{p_WC + step_s * V_WC.v + lever_W, quaternion_of(V_WC.w * step_s) * joint.X_WT.q};
    const Twist V_WT{V_WC.v + V_WC.w.cross(lever_W), V_WC.w};
    joint.wrench_W = haptics::coupling_wrenches(*joint.law, joint.target.X, joint.target.V, X_WT, V_WT).on_tool_W;
    joint.is_solved = true;
  }
  for (TouchCoupling& coupling : couplings) {
    const TouchThing& thing = things[coupling.thing];
    if (!thing.is_at_handle()) continue;
    coupling.wrench_W = shown_W(step_s, thing, felt[coupling.thing].wrench_W, coupling, joints);
  }
}

Wrench InertialessThings::shown_W(double step_s, const TouchThing& thing, const Wrench& contact_W,
                                  const TouchCoupling& coupling, std::span<const TouchJoint> joints) const noexcept {
  const Motion& motion = motions_[coupling.thing];
  const Quat turn = quaternion_of(motion.V_WC.w * step_s);
  const Vec3 p_WC = thing.rigid->centre_W();
  const Vec3 lever_W = turn * (coupling.X_WT.p - p_WC);
  const Vec3 p_WT = p_WC + step_s * motion.V_WC.v + lever_W;
  Vec3 force = contact_W.f + thing.wrench_W.f;
  Vec3 torque = contact_W.t - p_WT.cross(contact_W.f) + thing.wrench_W.t - lever_W.cross(thing.wrench_W.f);
  for (const TouchJoint& joint : joints) {
    if (joint.thing != coupling.thing) continue;
    force += joint.wrench_W.f;
    torque += joint.wrench_W.t + (turn * (joint.X_WT.p - coupling.X_WT.p)).cross(joint.wrench_W.f);
  }
  const haptics::CouplingParameters& c = coupling.hand->parameters();
  return {haptics::saturated(Vec3(-force / motion.hands), c.force_limit_n, c.saturation_softness),
          haptics::saturated(Vec3(-torque / motion.hands), c.torque_limit_n_m, c.saturation_softness)};
}

}  // namespace tandem::physics
