#include "lab/studies/contact/touch_simulation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "common/contact/contact_pair.hpp"
#include "common/contact/contact_reduction.hpp"
#include "common/contact/contact_solver.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "lab/studies/contact/mesh_generators.hpp"
#include "server/physics/gimpact_reference.hpp"

namespace tandem::lab {
namespace {

constexpr double kDampingRatio = 0.7;
constexpr double kMinBand_m = 5e-5;
constexpr std::size_t kReducedContacts = 16;
/// A torque is divided by the largest distance of a contact from the tool's origin, but at least by this distance.
/// Division by a smaller one would exaggerate the torque error.
constexpr double kMinSpread_m = 1e-3;

/// Tracks the difference between the wrench of the reduced contacts and the wrench of all contacts.
class ReductionError {
 public:
  /// Returns the force jump of a step; see run_touch(). It is the change of the reduction error since the previous
  /// call. Before the comparison, the previous error is extrapolated to this pose by the derivative of the wrench.
  double change_n(std::span<const contact::ContactPoint> contacts, double stiffness_n_per_m3, const Pose& X_WT) {
    const std::size_t count = contact::reduce_contacts(contacts, stiffness_n_per_m3, reduced_);
    const contact::ContactWrench all = contact::contact_wrench(contacts, stiffness_n_per_m3, X_WT.p);
    const contact::ContactWrench few = contact::contact_wrench(std::span(reduced_).first(count), X_WT.p);
    const Error error{few.on_a_W - all.on_a_W, few.derivative - all.derivative, X_WT};
    const Wrench change = error.wrench_W - before_.carried_to(X_WT);
    before_ = error;
    double spread = kMinSpread_m;
    for (const contact::ContactPoint& contact : contacts) spread = std::max(spread, (contact.p_W - X_WT.p).norm());
    return std::max(change.f.norm(), change.t.norm() / spread);
  }

 private:
  /// Error of the wrench of the reduced contacts about the tool's origin, and of its derivative.
  struct Error {
    Wrench wrench_W;
    Mat6 derivative = Mat6::Zero();
    Pose X_WT;

    Wrench carried_to(const Pose& X_WT_now) const {
      const Vec3 way = X_WT_now.p - X_WT.p;
      Vec6 motion;
      motion << way, rotation_vector(X_WT_now.q * X_WT.q.conjugate());
      const Vec6 change = derivative * motion;
      const Vec3 force = wrench_W.f + change.head<3>();
      return {force, wrench_W.t + change.tail<3>() - way.cross(force)};
    }
  };

  std::array<contact::ReducedContact, kReducedContacts> reduced_;
  Error before_;
};

/// Our own contact method: search and implicit solver.
class TouchSimulation {
 public:
  TouchSimulation(const contact::ContactShape& tool, const contact::ContactShape& fixed, const TouchSettings& settings,
                  const Pose& X_WT, const Twist& V_WT, const Clock& clock)
      : settings_(settings),
        clock_(clock),
        radius_m_(tool.radius_m()),
        rigid_depth_m_(std::min(tool.rigid_depth_m, fixed.rigid_depth_m)),
        inertia_T_(box_inertia_kg_m2(tool.high_S - tool.low_S, settings.mass_kg).asDiagonal()),
        law_(haptics::make_coupling_law("spring-damper",
                                        damped_for(settings.coupling, settings.mass_kg, inertia_T_.diagonal()))),
        solver_({.bodies = 1, .couplings = 1, .patches = 1, .contacts = contact::kContactBudget}),
        X_WT_(X_WT),
        V_WT_(V_WT) {
    pair_.bind(&tool, &fixed);
  }

  TouchStep step(const Pose& X_WH, const Twist& V_WH) {
    const double h = settings_.step_s;
    // The contact band is the largest distance by which the surfaces may approach within a step. It is computed from
    // the faster of hand and tool. The factor 1.5 allows for velocity that the tool gains within the step.
    const double speed = std::max(V_WT_.v.norm() + V_WT_.w.norm() * radius_m_, V_WH.v.norm());
    const double band = std::max(kMinBand_m, 1.5 * speed * h);
    TouchStep result;
    const LocalTime begin = clock_.now();
    const contact::ContactWork work = pair_.find(X_WT_, Pose{}, band);
    const LocalTime found = clock_.now();
    result.contact_stored_j = stored_j();
    const Twist V_before_WT = V_WT_;
    const LocalTime solve_begin = clock_.now();
    const contact::SolverReport report = solve(X_WH, V_WH);
    const LocalTime end = clock_.now();

    result.query = found - begin;
    result.step = (found - begin) + (end - solve_begin);
    result.queries = work.queries();
    result.found = static_cast<std::uint32_t>(pair_.contacts().size());
    result.contacts = patch_result_.pressing;
    result.reported_depth_m = patch_result_.deepest_m;
    result.has_converged = report.has_converged;
    result.force_jump_n = error_.change_n(pair_.contacts(), contact::SolverPatch{}.stiffness_n_per_m3, X_WT_);
    result.on_hand_W = haptics::reaction_on_hand(tool_wrench_W_, X_WH.p - X_WT_.p);
    result.kinetic_j = kinetic_j(V_WT_);
    result.contact_work_j = result.kinetic_j - kinetic_j(V_before_WT) - work_beside_contact_j(V_before_WT);
    X_WT_ = integrate(X_WT_, V_WT_, h);
    result.X_WT = X_WT_;
    return result;
  }

 private:
  double kinetic_j(const Twist& V_WT) const {
    const Vec3 w_T = X_WT_.q.conjugate() * V_WT.w;
    return 0.5 * (settings_.mass_kg * V_WT.v.squaredNorm() + w_T.dot(inertia_T_ * w_T));
  }
  /// Returns the work of coupling and weight in the step from the velocities V_before_WT to the current ones. A force
  /// that changes the velocity within a step does its work at the mean of both velocities. Therefore the work of all
  /// forces equals the gain of kinetic energy, except for rounding.
  double work_beside_contact_j(const Twist& V_before_WT) const {
    const Vec3 f = tool_wrench_W_.f + settings_.mass_kg * settings_.gravity_m_per_s2;
    return 0.5 * settings_.step_s * (f.dot(V_before_WT.v + V_WT_.v) + tool_wrench_W_.t.dot(V_before_WT.w + V_WT_.w));
  }
  /// Returns the energy stored in the contact layers and in friction, by the model of the class ContactRows. A layer is
  /// elastic up to the rigid depth. Beyond this depth, its force is constant.
  double stored_j() const {
    double sum = 0;
    for (const contact::ContactPoint& contact : pair_.contacts()) {
      const double soft_m = std::clamp(contact.depth_m, 0.0, rigid_depth_m_);
      const double rest_m = std::max(contact.depth_m - rigid_depth_m_, 0.0);
      const double bent_m2 = contact::kTangentialRatio * contact.bristle_W.squaredNorm();
      sum +=
          contact::SolverPatch{}.stiffness_n_per_m3 * contact.area_m2 * (soft_m * (soft_m / 2 + rest_m) + bent_m2 / 2);
    }
    return sum;
  }
  contact::SolverReport solve(const Pose& X_WH, const Twist& V_WH) {
    const Eigen::Matrix3d R = X_WT_.q.toRotationMatrix();
    contact::SolverBody body;
    body.mass_kg = settings_.mass_kg;
    body.inertia_W = R * inertia_T_ * R.transpose();
    body.p_WC = X_WT_.p;
    body.V_WC = V_WT_;
    body.wrench_W.f = settings_.mass_kg * settings_.gravity_m_per_s2;
    const contact::SolverCoupling coupling{0, law_.get(), X_WH, V_WH, X_WT_};
    contact::SolverPatch patch;
    patch.contacts = pair_.contacts();
    patch.rigid_depth_m = rigid_depth_m_;
    patch.friction = settings_.friction;
    const contact::SolverReport report =
        solver_.step(settings_.step_s, std::span(&body, 1), std::span(&coupling, 1), std::span(&patch, 1),
                     std::span(&patch_result_, 1), std::span(&tool_wrench_W_, 1));
    V_WT_ = body.V_WC;
    return report;
  }

  TouchSettings settings_;
  const Clock& clock_;
  double radius_m_;
  double rigid_depth_m_;
  Eigen::Matrix3d inertia_T_;
  std::unique_ptr<haptics::CouplingLaw> law_;
  contact::ContactPair pair_;
  contact::ContactSolver solver_;
  ReductionError error_;
  contact::PatchResult patch_result_;
  Wrench tool_wrench_W_;
  Pose X_WT_;
  Twist V_WT_;
};

/// Returns the start pose of the tool. A tool that the hand holds hangs at rest below the hand.
Pose resting_pose(Pose X_WT, const TouchSettings& settings) {
  if (settings.coupling.stiffness_n_per_m <= 0) return X_WT;
  X_WT.p += settings.mass_kg * settings.gravity_m_per_s2 / settings.coupling.stiffness_n_per_m;
  return X_WT;
}

/// Calls `step(pose, twist)` with the state of the hand for every step from `begin` on.
template <class Step>
TouchTrace trace_of(const devices::HandPath& path, const TouchSettings& settings, Duration begin, std::size_t steps,
                    const Step& step) {
  TouchTrace trace;
  const Duration period = from_seconds(settings.step_s);
  for (Duration at = begin; at < path.length() && trace.size() < steps; at += period) {
    TouchStep result = step(path.pose_at(at), path.twist_at(at));
    result.at = at;
    result.phase = path.phase_at(at);
    trace.push_back(result);
  }
  return trace;
}

}  // namespace

Vec3 box_inertia_kg_m2(const Vec3& size_m, double mass_kg) {
  const Vec3 squares = size_m.cwiseAbs2();
  return mass_kg / 12 * (Vec3::Constant(squares.sum()) - squares);
}

haptics::CouplingParameters damped_for(haptics::CouplingParameters coupling, double mass_kg,
                                       const Vec3& inertia_kg_m2) {
  coupling.damping_n_s_per_m = 2 * kDampingRatio * std::sqrt(coupling.stiffness_n_per_m * mass_kg);
  // The damping is chosen for the axis with the smallest inertia. Rotation about the other axes has a smaller damping
  // ratio. A larger damping would make GImpact unstable, because its coupling is integrated explicitly.
  coupling.damping_n_m_s_per_rad =
      2 * kDampingRatio * std::sqrt(coupling.stiffness_n_m_per_rad * inertia_kg_m2.minCoeff());
  return coupling;
}

TouchTrace run_touch(const contact::ContactShape& tool, const contact::ContactShape& fixed,
                     const devices::HandPath& path, const TouchSettings& settings, const Clock& clock, Duration begin,
                     std::size_t steps) {
  const Pose start = resting_pose(path.pose_at(begin), settings);
  TouchSimulation simulation(tool, fixed, settings, start, path.twist_at(begin), clock);
  return trace_of(path, settings, begin, steps,
                  [&](const Pose& X_WH, const Twist& V_WH) { return simulation.step(X_WH, V_WH); });
}

TouchTrace run_touch(const contact::ContactShape& tool, const contact::ContactShape& fixed,
                     const std::function<RigidState(Duration)>& hand_at, Duration length, const TouchSettings& settings,
                     const Clock& clock) {
  const auto [start, start_twist] = hand_at(Duration{0});
  TouchSimulation simulation(tool, fixed, settings, resting_pose(start, settings), start_twist, clock);
  TouchTrace trace;
  for (Duration at{0}; at < length; at += from_seconds(settings.step_s)) {
    const auto [X_WH, V_WH] = hand_at(at);
    trace.push_back(simulation.step(X_WH, V_WH));
    trace.back().at = at;
  }
  return trace;
}

TouchTrace fastest_of(const std::vector<TouchTrace>& runs) {
  TouchTrace fastest = runs.front();
  for (const TouchTrace& run : runs) {
    for (std::size_t i = 0; i < fastest.size(); ++i) {
      TouchStep& step = fastest[i];
      if (run[i].X_WT.p != step.X_WT.p) throw std::logic_error("equal runs of a touch moved differently");
      step.query = std::min(step.query, run[i].query);
      step.step = std::min(step.step, run[i].step);
    }
  }
  return fastest;
}

TouchTrace run_gimpact(const geometry::TriangleMesh& tool, const geometry::TriangleMesh& fixed,
                       const devices::HandPath& path, const TouchSettings& settings, const Clock& clock, Duration begin,
                       std::size_t steps) {
  const Eigen::AlignedBox3d bounds = bounds_of(tool);
  const Vec3 inertia = box_inertia_kg_m2(bounds.max() - bounds.min(), settings.mass_kg);
  server::GImpactReference peer(tool, fixed, settings.mass_kg, inertia, settings.friction, clock);
  const auto law =
      haptics::make_coupling_law("spring-damper", damped_for(settings.coupling, settings.mass_kg, inertia));
  Pose X_WT = resting_pose(path.pose_at(begin), settings);
  Twist V_WT;
  peer.place(X_WT);
  return trace_of(path, settings, begin, steps, [&](const Pose& X_WH, const Twist& V_WH) {
    const haptics::CouplingWrenches pull = haptics::coupling_wrenches(*law, X_WH, V_WH, X_WT, V_WT);
    Wrench on_tool_W = pull.on_tool_W;
    on_tool_W.f += settings.mass_kg * settings.gravity_m_per_s2;
    const server::GImpactReference::Step stepped = peer.step(on_tool_W, settings.step_s);
    X_WT = stepped.X_WT;
    V_WT = stepped.V_WT;
    TouchStep result;
    result.X_WT = stepped.X_WT;
    result.on_hand_W = pull.on_hand_W;
    result.contacts = result.found = static_cast<std::uint32_t>(stepped.contacts);
    result.query = stepped.query;
    result.step = stepped.whole;
    return result;
  });
}

}  // namespace tandem::lab
