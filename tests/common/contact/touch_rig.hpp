// Test rig: one body with a real contact shape among fixed obstacles. Search and solver run as in the server, so that
// tests cover all of common/contact.
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "common/contact/contact_pair.hpp"
#include "common/contact/contact_solver.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "tests/common/contact/touch_scene.hpp"

namespace tandem::contact {

using ShapePointer = std::shared_ptr<const ContactShape>;

inline ShapePointer solid_of(const geometry::TriangleMesh& mesh) {
  return make_contact_mesh(geometry::repaired(mesh));
}

/// Returns a coupling that is critically damped for this body. Its default stiffness is 300 N/m.
inline haptics::CouplingParameters critical_coupling(double mass_kg, double inertia_kg_m2,
                                                     double stiffness_n_per_m = 300) {
  haptics::CouplingParameters c;
  c.stiffness_n_per_m = stiffness_n_per_m;
  c.damping_n_s_per_m = 2 * std::sqrt(stiffness_n_per_m * mass_kg);
  c.damping_n_m_s_per_rad = 2 * std::sqrt(c.stiffness_n_m_per_rad * inertia_kg_m2);
  return c;
}

/// A test body and its obstacles. The origin of the body is its centre of mass.
class TouchRig {
 public:
  ShapePointer shape;
  double mass_kg = 0.05;
  Eigen::Matrix3d inertia_B = sphere_inertia(0.05, 0.005);
  Pose X_WB;
  Twist V_WB;
  const haptics::CouplingLaw* law = nullptr;
  double coupling_force_n = 0;  ///< largest force of the coupling law
  Pose X_BT;
  Pose X_WH;
  Twist V_WH;
  double gravity_m_per_s2 = 0;
  double stiffness_n_per_m3 = 5e9;
  double friction = 0.5;
  double speed_limit_m_per_s = 10;

  SolverReport report;
  Wrench tool_wrench_W;
  Vec3 contact_force_W = Vec3::Zero();
  double normal_force_n = 0;
  double deepest_m = 0;
  bool is_coarse = false;

  explicit TouchRig(ContactSolver& solver) : solver_(solver) {}

  void add_obstacle(ShapePointer obstacle, const Pose& X_WO = {}) {
    obstacles_.push_back({std::move(obstacle), X_WO, ContactPair(), false});
  }

  void step() {
    find(band_m());
    SolverBody body{mass_kg, inertia_W(), X_WB.p, V_WB, {}};
    body.wrench_W.f.z() -= mass_kg * gravity_m_per_s2;
    const SolverCoupling coupling{0, law, X_WH, V_WH, X_WB * X_BT};
    patches_.clear();
    for (Obstacle& obstacle : obstacles_) {
      const double rigid_m = std::min(shape->rigid_depth_m, obstacle.shape->rigid_depth_m);
      patches_.push_back({0, kStaticBody, obstacle.pair.contacts(), stiffness_n_per_m3, rigid_m, friction});
    }
    results_.assign(patches_.size(), {});
    report = solver_.step(kStep_s, {&body, 1}, {&coupling, law != nullptr ? 1U : 0U}, patches_, results_,
                          {&tool_wrench_W, 1});
    V_WB = body.V_WC;
    V_WB.v = clamped_to_length(V_WB.v, speed_limit_m_per_s);
    X_WB = integrate(X_WB, V_WB, kStep_s);
    sum_up();
  }

  void run(double seconds) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds / kStep_s)); ++i) step();
  }

  /// Runs the contact search, but no step of the solver.
  void find(double band_m) {
    is_coarse = false;
    for (Obstacle& obstacle : obstacles_) {
      if (!obstacle.is_bound) obstacle.pair.bind(shape.get(), obstacle.shape.get());
      obstacle.is_bound = true;
      is_coarse = obstacle.pair.find(X_WB, obstacle.X_WO, band_m).is_coarse || is_coarse;
    }
  }
  std::span<const ContactPoint> contacts(std::size_t obstacle = 0) const {
    return obstacles_[obstacle].pair.contacts();
  }

  /// Returns the kinetic and potential energy plus the elastic energy of the contacts at the current pose.
  double energy_j() {
    find(2e-4);
    double energy = 0.5 * mass_kg * V_WB.v.squaredNorm() + 0.5 * V_WB.w.dot(inertia_W() * V_WB.w) +
                    mass_kg * gravity_m_per_s2 * X_WB.p.z();
    for (const Obstacle& obstacle : obstacles_) {
      for (const ContactPoint& c : obstacle.pair.contacts()) {
        const double depth = std::max(0.0, c.depth_m);
        energy += 0.5 * stiffness_n_per_m3 * c.area_m2 * depth * depth;
      }
    }
    return energy;
  }
  /// Returns an upper bound of the speed of the fastest surface point.
  double speed_m_per_s() const { return V_WB.v.norm() + V_WB.w.norm() * shape->radius_m(); }

 private:
  struct Obstacle {
    ShapePointer shape;
    Pose X_WO;
    ContactPair pair;
    bool is_bound = false;
  };

  Eigen::Matrix3d inertia_W() const { return X_WB.q * inertia_B * X_WB.q.conjugate().toRotationMatrix(); }

  /// Returns the search distance [m]: the distance that the body may move in a step, with a margin.
  /// common/physics/touch/touch_stage.cpp has the same formula.
  double band_m() const {
    const double gained = (coupling_force_n + mass_kg * gravity_m_per_s2) / mass_kg * kStep_s;
    const double speed = V_WB.v.norm() + V_WB.w.norm() * 2 * shape->radius_m() + gained;
    return std::max(2e-4, 1.5 * std::min(speed, speed_limit_m_per_s) * kStep_s);
  }

  void sum_up() {
    contact_force_W.setZero();
    normal_force_n = deepest_m = 0;
    for (const PatchResult& result : results_) {
      contact_force_W += result.on_a_W.f;
      normal_force_n += result.normal_force_n;
      deepest_m = std::max(deepest_m, result.deepest_m);
    }
  }

  ContactSolver& solver_;
  std::deque<Obstacle> obstacles_;
  std::vector<SolverPatch> patches_;
  std::vector<PatchResult> results_;
};

}  // namespace tandem::contact
