// Test scene without contact search: a body made of sample points above planes. Its contact forces have a closed form.
#pragma once

#include <numbers>
#include <vector>

#include "common/contact/contact_solver.hpp"
#include "common/haptics/coupling/laws.hpp"

namespace tandem::contact {

inline constexpr double kStep_s = 1e-3;
inline constexpr double kGravity_m_per_s2 = 9.81;

struct SurfaceSample {
  Vec3 p_B = Vec3::Zero();
  double area_m2 = 0;
};

/// A half-space that is solid where n·p < offset.
struct Plane {
  Vec3 normal_W = Vec3::UnitZ();
  double offset_m = 0;
  double thickness_m = 1;  ///< deeper points have passed through the solid and get no force
};

/// Returns points that are evenly distributed on a sphere by the golden angle.
inline std::vector<SurfaceSample> sphere_samples(double radius_m, int count) {
  std::vector<SurfaceSample> samples;
  const double area_m2 = 4 * std::numbers::pi * radius_m * radius_m / count;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - z * z);
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    samples.push_back({radius_m * Vec3(r * std::cos(angle), r * std::sin(angle), z), area_m2});
  }
  return samples;
}

/// Returns the points of a lattice on each face of a box, including the borders. Areas follow the trapezoidal rule.
inline std::vector<SurfaceSample> box_samples(const Vec3& size_m, int across) {
  std::vector<SurfaceSample> samples;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double cell_m2 = size_m[u] * size_m[v] / (across * across);
    for (int i = 0; i <= across; ++i) {
      for (int j = 0; j <= across; ++j) {
        const double share = (i % across == 0 ? 0.5 : 1.0) * (j % across == 0 ? 0.5 : 1.0);
        for (const double side : {-0.5, 0.5}) {
          Vec3 p;
          p[axis] = side * size_m[axis];
          p[u] = (double(i) / across - 0.5) * size_m[u];
          p[v] = (double(j) / across - 0.5) * size_m[v];
          samples.push_back({p, share * cell_m2});
        }
      }
    }
  }
  return samples;
}

inline Eigen::Matrix3d sphere_inertia(double mass_kg, double radius_m) {
  return Eigen::Matrix3d::Identity() * (0.4 * mass_kg * radius_m * radius_m);
}

inline Eigen::Matrix3d box_inertia(double mass_kg, const Vec3& size_m) {
  const Vec3 s = size_m.cwiseProduct(size_m) * (mass_kg / 12);
  return Vec3(s.y() + s.z(), s.z() + s.x(), s.x() + s.y()).asDiagonal();
}

/// One body made of sample points above planes, optionally held by a coupling. The body's origin is its centre of mass.
class TouchScene {
 public:
  double mass_kg = 0.05;
  Eigen::Matrix3d inertia_B = sphere_inertia(0.05, 0.005);
  std::vector<SurfaceSample> samples;
  std::vector<Plane> planes;
  const haptics::CouplingLaw* law = nullptr;
  Pose X_BT;  ///< pose of the coupling's tool frame in the body
  Pose X_WH;
  Twist V_WH;
  Pose X_WB;
  Twist V_WB;
  Wrench load_W;  ///< external load, excluding weight
  double gravity_m_per_s2 = 0;
  double stiffness_n_per_m3 = 5e9;
  double friction = 0.5;
  double dissipation_s = 1e-3;
  double rigid_depth_m = 5e-4;
  double band_m = 3e-3;

  std::vector<PatchResult> results;
  Wrench tool_wrench_W;
  SolverReport report;

  explicit TouchScene(ContactSolver& solver) : solver_(solver) {}

  void step() {
    find_contacts();
    SolverBody body{mass_kg, inertia_W(), X_WB.p, V_WB, load_W};
    body.wrench_W.f.z() -= mass_kg * gravity_m_per_s2;
    const SolverCoupling coupling{0, law, X_WH, V_WH, X_WB * X_BT};
    std::vector<SolverPatch> patches;
    for (std::vector<ContactPoint>& contacts : contacts_) {
      patches.push_back({0, kStaticBody, contacts, stiffness_n_per_m3, rigid_depth_m, friction, dissipation_s});
    }
    results.assign(patches.size(), {});
    report =
        solver_.step(kStep_s, {&body, 1}, {&coupling, law != nullptr ? 1U : 0U}, patches, results, {&tool_wrench_W, 1});
    V_WB = body.V_WC;
    X_WB = integrate(X_WB, V_WB, kStep_s);
  }

  void run(double seconds) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds / kStep_s)); ++i) step();
  }

  double deepest_m() const {
    double deepest = -1;
    for (const Plane& plane : planes) {
      for (const SurfaceSample& sample : samples) {
        const double depth = plane.offset_m - plane.normal_W.dot(X_WB * sample.p_B);
        if (depth <= plane.thickness_m) deepest = std::max(deepest, depth);
      }
    }
    return deepest;
  }
  /// Returns the kinetic and potential energy plus the elastic energy of the contacts.
  double energy_j() const {
    double energy = 0.5 * mass_kg * V_WB.v.squaredNorm() + 0.5 * V_WB.w.dot(inertia_W() * V_WB.w) +
                    mass_kg * gravity_m_per_s2 * X_WB.p.z();
    for (const Plane& plane : planes) {
      for (const SurfaceSample& sample : samples) {
        const double depth = std::max(0.0, plane.offset_m - plane.normal_W.dot(X_WB * sample.p_B));
        energy += 0.5 * stiffness_n_per_m3 * sample.area_m2 * depth * depth;
      }
    }
    return energy;
  }
  double speed_m_per_s() const { return V_WB.v.norm(); }

 private:
  Eigen::Matrix3d inertia_W() const { return X_WB.q * inertia_B * X_WB.q.conjugate().toRotationMatrix(); }

  void find_contacts() {
    contacts_.resize(planes.size());
    bristles_.resize(planes.size(), std::vector<Vec3>(samples.size(), Vec3::Zero()));
    for (std::size_t k = 0; k < planes.size(); ++k) {
      for (const ContactPoint& old : contacts_[k]) bristles_[k][old.id] = old.bristle_W;
      contacts_[k].clear();
      for (std::size_t i = 0; i < samples.size(); ++i) {
        const Vec3 p_W = X_WB * samples[i].p_B;
        const double depth = planes[k].offset_m - planes[k].normal_W.dot(p_W);
        if (depth < -band_m || depth > planes[k].thickness_m) {
          bristles_[k][i].setZero();
          continue;
        }
        contacts_[k].push_back(
            {p_W, planes[k].normal_W, depth, samples[i].area_m2, bristles_[k][i], static_cast<std::uint32_t>(i)});
      }
    }
  }

  ContactSolver& solver_;
  std::vector<std::vector<ContactPoint>> contacts_;
  std::vector<std::vector<Vec3>> bristles_;
};

}  // namespace tandem::contact
