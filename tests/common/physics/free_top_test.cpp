// Compares torque-free rotation with the closed form and with an independent integrator. The rotation must be the same
// in both stages and across changes of stage.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/random.hpp"
#include "tests/common/physics/world_support.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::physics {
namespace {

constexpr BodyId kTop{1};
constexpr int kTopSteps = 10'000;
constexpr double kDegree = std::numbers::pi / 180;

/// The stage that moves the top.
enum class TopStage { kUntouched, kTouched, kChanging };

WorldDescription world_of_top(const Vec3& inertia_kg_m2) {
  WorldDescription world = world_of({cube({0, 0, 0}, 0.2)}, {ball_tool({0, 0, 2})});
  world.bodies[0].mass.principal_inertia_kg_m2 = inertia_kg_m2;
  return world;
}

Vec3 momentum_W(const Quat& q, const Vec3& inertia, const Vec3& w) {
  return q * (q.conjugate() * w).cwiseProduct(inertia);
}
double spin_energy_j(const Quat& q, const Vec3& inertia, const Vec3& w) {
  return 0.5 * (q.conjugate() * w).cwiseAbs2().dot(inertia);
}
double angle_between(const Quat& a, const Quat& b) {
  return rotation_vector(a * b.conjugate()).norm();
}

/// Integrates the attitude at constant angular momentum with the fourth-order Runge–Kutta method.
Quat turned_by_runge_kutta(Quat q, const Vec3& inertia, const Vec3& L, double step_s) {
  const auto rate = [&](const Quat& at) {
    const Vec3 w = at * (at.conjugate() * L).cwiseQuotient(inertia);
    return Quat((Quat(0, 0.5 * w.x(), 0.5 * w.y(), 0.5 * w.z()) * at).coeffs());
  };
  const auto plus = [](const Quat& a, const Quat& b, double scale) { return Quat(a.coeffs() + scale * b.coeffs()); };
  const Quat k1 = rate(q), k2 = rate(plus(q, k1, step_s / 2)), k3 = rate(plus(q, k2, step_s / 2)),
             k4 = rate(plus(q, k3, step_s));
  q.coeffs() += step_s / 6 * (k1.coeffs() + 2 * k2.coeffs() + 2 * k3.coeffs() + k4.coeffs());
  return q.normalized();
}

struct TopErrors {
  double momentum = 0, energy = 0;  ///< largest error in the run, relative to the initial value
  double attitude_rad = 0;          ///< error at the end
};

/// Moves the top for 10 s. `reference(q, step_s)` advances the attitude with which the top is compared.
template <class Reference>
TopErrors spin(const Vec3& inertia, const Quat& q0, const Vec3& w0, TopStage stage, const Reference& reference) {
  World world = server_world(world_of_top(inertia));
  world.set_body(kTop, {{Vec3::Zero(), q0}, {Vec3::Zero(), w0}});
  if (stage == TopStage::kTouched) world.keep_implicit(kTop, 3600);
  const Vec3 L0 = momentum_W(q0, inertia, w0);
  const double E0 = spin_energy_j(q0, inertia, w0);
  TopErrors errors;
  Quat q = q0;
  for (int i = 0; i < kTopSteps; ++i) {
    if (stage == TopStage::kChanging && i % 100 == 0) world.keep_implicit(kTop, i % 200 == 0 ? 1 : 0);
    EXPECT_EQ(world.step(), 0U);
    const RigidState state = world.body(kTop);
    errors.momentum = std::max(errors.momentum, (momentum_W(state.X.q, inertia, state.V.w) - L0).norm() / L0.norm());
    errors.energy = std::max(errors.energy, std::abs(spin_energy_j(state.X.q, inertia, state.V.w) - E0) / E0);
    q = reference(q, kStep_s);
  }
  errors.attitude_rad = angle_between(world.body(kTop).X.q, q);
  return errors;
}

Vec3 random_direction(Random& random) {
  Vec3 v;
  do {
    v = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  } while (v.norm() > 1 || v.norm() < 0.1);
  return v.normalized();
}

TEST(FreeTop, SymmetricOnesFollowTheClosedForm) {
  for (const double ratio : {0.2, 0.7, 1.3, 1.9}) {
    for (const double rad_per_s : {1.0, 9.0, 78.0}) {
      const double across = 1e-4;
      const Vec3 inertia(across, across, ratio * across);
      const Quat q0 = quaternion_of({0.3, -0.5, 0.2});
      const Vec3 w0 = rad_per_s * (q0 * Vec3(0.4, 0.3, 0.8).normalized());
      const Vec3 L = momentum_W(q0, inertia, w0);
      const double w3 = (q0.conjugate() * w0).z();
      double time_s = 0;
      const auto closed = [&](const Quat&, double step_s) {
        time_s += step_s;
        return quaternion_of(time_s / across * L) * q0 * quaternion_of(Vec3(0, 0, time_s * (1 - ratio) * w3));
      };
      const TopErrors errors = spin(inertia, q0, w0, TopStage::kChanging, closed);
      EXPECT_LT(errors.momentum, 1e-6) << ratio << ", " << rad_per_s;
      EXPECT_LT(errors.energy, 1e-3) << ratio << ", " << rad_per_s;
      EXPECT_LT(errors.attitude_rad, (rad_per_s > 9 ? 2 : 0.1) * kDegree) << ratio << ", " << rad_per_s;
    }
  }
}

TEST(FreeTop, KeepsMomentumEnergyAndAttitudeInEachStageAndThroughTheChange) {
  const std::uint64_t seed = test::test_seed(60);
  Random random(seed);
  TopErrors worst;
  double worst_slow_rad = 0, worst_fast_rad = 0;
  for (int run = 0; run < 200; ++run) {
    Vec3 inertia(random.uniform(0.1, 1), random.uniform(0.1, 1), 0);
    // A physically possible inertia: no principal moment exceeds the sum of the other two.
    inertia.z() = random.uniform(std::abs(inertia.x() - inertia.y()) + 0.02, inertia.x() + inertia.y() - 0.02);
    inertia *= 1e-4;
    const Quat q0 = quaternion_of(3 * random.uniform() * random_direction(random));
    const bool is_fast = run % 2 == 0;
    const Vec3 w_body = (is_fast ? random.uniform(9, 80) : random.uniform(1, 9)) * random_direction(random);
    int middle = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (inertia[axis] > inertia.minCoeff() && inertia[axis] < inertia.maxCoeff()) middle = axis;
    }
    if (std::abs(w_body[middle]) > std::cos(5 * kDegree) * w_body.norm()) continue;
    const Vec3 w0 = q0 * w_body;
    const Vec3 L = momentum_W(q0, inertia, w0);
    const auto reference = [&](Quat q, double step_s) {
      for (int k = 0; k < 2; ++k) q = turned_by_runge_kutta(q, inertia, L, step_s / 2);
      return q;
    };
    const TopErrors errors = spin(inertia, q0, w0, static_cast<TopStage>(run % 3), reference);
    worst.momentum = std::max(worst.momentum, errors.momentum);
    worst.energy = std::max(worst.energy, errors.energy);
    double& worst_rad = is_fast ? worst_fast_rad : worst_slow_rad;
    worst_rad = std::max(worst_rad, errors.attitude_rad);
    EXPECT_LT(errors.momentum, 1e-3) << "seed " << seed << ", run " << run;
    EXPECT_LT(errors.energy, 1e-3) << "seed " << seed << ", run " << run;
    EXPECT_LT(errors.attitude_rad, (is_fast ? 15 : 0.5) * kDegree) << "seed " << seed << ", run " << run;
  }
  std::cout << "worst: momentum " << worst.momentum << ", energy " << worst.energy << ", attitude "
            << worst_slow_rad / kDegree << " degrees up to 9 rad/s, " << worst_fast_rad / kDegree << " up to 80\n";
}

}  // namespace
}  // namespace tandem::physics
