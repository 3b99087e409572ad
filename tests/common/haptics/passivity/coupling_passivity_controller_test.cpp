#include "common/haptics/passivity/coupling_passivity_controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

constexpr double kCouplingPassivityControllerPeriod = 1e-3;
constexpr double kMaxTaken_j = 1e-5;

Pose tool_at_x(double x) {
  return {Vec3(x, 0, 0), Quat::Identity()};
}
Wrench force_x(double f) {
  return {Vec3(f, 0, 0), Vec3::Zero()};
}

/// A spring and damper between x and the origin. As a wall, it acts only for x > 0. The velocity is a backward
/// difference.
struct SampledSpring {
  double stiffness;
  double damping;
  bool is_wall = false;
  double last_x = 0;

  double force(double x) {
    const double velocity = (x - last_x) / kCouplingPassivityControllerPeriod;
    last_x = x;
    if (is_wall && x <= 0) return 0;
    return -stiffness * x - damping * velocity;
  }
};

/// A simulated hand that moves as far as possible along the force. It extracts all energy that sampling creates.
class GreedyDriver {
 public:
  GreedyDriver(double speed_limit, Random random)
      : most_(speed_limit * kCouplingPassivityControllerPeriod), random_(random) {}

  double next_step(double force) {
    size_ = std::min(size_ + PortLookAhead::kMaxAcceleration_m_per_s2 * kCouplingPassivityControllerPeriod *
                                 kCouplingPassivityControllerPeriod,
                     most_);
    // Without a force, the driver stretches the spring in a random direction.
    const double direction = force != 0 ? std::copysign(1.0, force) : (random_.uniform() < 0.5 ? -1.0 : 1.0);
    return direction * size_;
  }

 private:
  double size_ = 0;
  double most_;
  Random random_;
};

struct Taken {
  double most_j = 0;  ///< largest energy that the driver extracted
  double withheld_j = 0;
};

Taken drive(double stiffness, double damping, double speed, bool is_controlled, std::uint64_t seed) {
  Random random(seed, 0);
  SampledSpring spring{stiffness, damping};
  GreedyDriver driver(speed, random);
  CouplingPassivityController controller;
  double x = 0, taken = 0;
  Taken result;
  for (int k = 0; k < 3000; ++k) {
    double f = spring.force(x);
    if (is_controlled) f = controller.apply(tool_at_x(x), force_x(f), 0, kCouplingPassivityControllerPeriod).f.x();
    const double step = driver.next_step(f);
    x += step;
    taken += f * step;
    result.most_j = std::max(result.most_j, taken);
  }
  result.withheld_j = controller.withheld_j();
  return result;
}

TEST(CouplingPassivityController, AGreedyDriverGetsNoMoreThanTheInitialCredit) {
  double most_uncontrolled = 0;
  std::uint64_t run = test::test_seed(0);
  for (const double stiffness : {100.0, 300.0, 1000.0, 5000.0}) {
    for (const double damping_of_kT : {0.0, 0.5, 1.0, 2.0}) {
      for (const double speed : {0.02, 0.1, 0.5}) {
        SCOPED_TRACE("k " + std::to_string(stiffness) + ", b " + std::to_string(damping_of_kT) + " k T, speed " +
                     std::to_string(speed) + ", seed " + std::to_string(run));
        const double damping = damping_of_kT * stiffness * kCouplingPassivityControllerPeriod;
        EXPECT_LE(drive(stiffness, damping, speed, true, run).most_j, kMaxTaken_j);
        most_uncontrolled = std::max(most_uncontrolled, drive(stiffness, damping, speed, false, run).most_j);
        ++run;
      }
    }
  }
  // Without the controller, the same drivers extract energy. The test can therefore detect a controller without effect.
  EXPECT_GT(most_uncontrolled, 3e-4);
}

TEST(CouplingPassivityController, EvenADamperTwiceWhatTheSpringNeedsFeedsADriverWithoutAController) {
  // In each period, the driver moves by dx = 0.5 mm, and sampling creates ½ k dx² = 125 µJ. The damper dissipates less
  // than usual, because the driver's motion is never smooth. Without the controller, the driver therefore extracts
  // energy.
  EXPECT_GT(drive(1000, 2, 0.5, false, 1).most_j, 3e-4);
  EXPECT_LE(drive(1000, 2, 0.5, true, 1).most_j, kMaxTaken_j);
}

TEST(CouplingPassivityController, ADriverInSixDimensionsGetsNoMoreThanTheInitialCredit) {
  Random random(test::test_seed(5), 0);
  CouplingPassivityController controller;
  Pose X;
  double taken = 0, most = 0;
  double step_m = 0, step_rad = 0;
  for (int k = 0; k < 5000; ++k) {
    const Wrench wanted{-2000 * X.p, -2 * rotation_vector(X.q)};
    const Wrench shown = controller.apply(X, wanted, 0, kCouplingPassivityControllerPeriod);
    step_m = std::min(step_m + 1e-4, 4e-4);
    step_rad = std::min(step_rad + 5e-3, 2e-2);
    const auto along = [&](const Vec3& a) {
      const Vec3 noise(random.normal(), random.normal(), random.normal());
      return Vec3(a.norm() > 0 && random.uniform() < 0.8 ? a.normalized() : noise.normalized());
    };
    const Vec3 step = along(shown.f) * step_m, turn = along(shown.t) * step_rad;
    X.p += step;
    X.q = (quaternion_of(turn) * X.q).normalized();
    taken += shown.f.dot(step) + shown.t.dot(turn);
    most = std::max(most, taken);
  }
  EXPECT_LE(most, kMaxTaken_j);
}

TEST(CouplingPassivityController, LeavesASmoothHandAloneOnceItIsSixTenthsOfAMillimetreIn) {
  for (const double stiffness : {300.0, 1000.0, 3000.0}) {
    SampledSpring wall{stiffness, stiffness * kCouplingPassivityControllerPeriod, true};
    CouplingPassivityController controller;
    for (int k = 0; k < 4000; ++k) {
      // The tool moves from 10 mm outside of the wall to 4 mm inside it and back, at 1 Hz.
      const double x =
          -3e-3 + 7e-3 * std::sin(2 * std::numbers::pi * k * kCouplingPassivityControllerPeriod - std::numbers::pi / 2);
      const double f = wall.force(x);
      const double shown = controller.apply(tool_at_x(x), force_x(f), 0, kCouplingPassivityControllerPeriod).f.x();
      // Deeper than 0.6 mm, the force must be unchanged. This follows for the stiffness k at the depth d:
      // 1. The controller scales the force F by s < 1 such that s F = (E + credit) / δ, where E is its balance.
      // 2. δ = |v| T + a T² = 0.14 mm is the predicted motion, with speed v, period T and largest acceleration a.
      // 3. E + credit therefore increases with the depth like credit · e^(d/δ).
      // 4. The scaling ends where E + credit reaches k d δ: at 0.45 mm for 3000 N/m, and earlier for a lower stiffness.
      if (x > 6e-4 || k > 1000) {
        ASSERT_EQ(shown, f) << "k = " << stiffness << ", tick " << k;
      }
    }
  }
}

TEST(CouplingPassivityController, ReturnsTheEnergyThatTheHandSupplied) {
  CouplingPassivityController controller;
  controller.apply(tool_at_x(0), force_x(-2), 0, kCouplingPassivityControllerPeriod);
  double x = 0;
  for (int k = 0; k < 20; ++k)
    controller.apply(tool_at_x(x += 1e-4), force_x(-2), 0, kCouplingPassivityControllerPeriod);
  const double stored = controller.balance_j();
  EXPECT_GT(stored, 0);
  // The tool moves back along the same path. Only the stored energy may be returned.
  double taken = 0;
  double shown = -2;
  for (int k = 0; k < 40; ++k) {
    x -= 1e-4;
    taken += -shown * 1e-4;
    shown = controller.apply(tool_at_x(x), force_x(-2), 0, kCouplingPassivityControllerPeriod).f.x();
    EXPECT_LE(taken, stored + kMaxTaken_j);
  }
  EXPECT_GT(taken, stored - kMaxTaken_j);
  EXPECT_GT(controller.withheld_j(), 0);
}

TEST(CouplingPassivityController, TheHandMayTakeWhatTheToolGivesBeyondWhatItGot) {
  CouplingPassivityController controller;
  controller.apply(tool_at_x(0), {}, 0, kCouplingPassivityControllerPeriod);
  controller.apply(tool_at_x(0), {}, 0.5, kCouplingPassivityControllerPeriod);   // the tool is lifted
  controller.apply(tool_at_x(0), {}, -0.5, kCouplingPassivityControllerPeriod);  // lowered again: nothing is stored
  EXPECT_EQ(controller.balance_j(), 0);
  controller.apply(
      tool_at_x(0), {}, -0.25,
      kCouplingPassivityControllerPeriod);  // below the start: the energy came from the weight or another user
  EXPECT_NEAR(controller.balance_j(), 0.25, 1e-12);
  EXPECT_EQ(controller.apply(tool_at_x(0), force_x(5), 0, kCouplingPassivityControllerPeriod).f.x(), 5);
}

TEST(CouplingPassivityController, DoesNotStarveAHandThatDragsATool) {
  // The tool is dragged against friction from the first tick on. Friction dissipates all energy that the hand supplies,
  // so the tool returns nothing.
  CouplingPassivityController controller;
  double x = 0;
  const double drag = 1.0, speed = 0.3;
  double shown = 0;
  for (int k = 0; k < 100; ++k) {
    shown = controller
                .apply(tool_at_x(x), force_x(-drag), drag * speed * kCouplingPassivityControllerPeriod,
                       kCouplingPassivityControllerPeriod)
                .f.x();
    x += speed * kCouplingPassivityControllerPeriod;
  }
  EXPECT_EQ(shown, -drag);
}

TEST(CouplingPassivityController, CountsTheDisplayedForce) {
  CouplingPassivityController controller;
  controller.apply(tool_at_x(0), force_x(-0.01), 0, kCouplingPassivityControllerPeriod);
  controller.set_displayed(force_x(-0.005));
  controller.apply(tool_at_x(0.1), {}, 0, kCouplingPassivityControllerPeriod);
  EXPECT_NEAR(controller.balance_j(), 0.005 * 0.1, 1e-15);
}

TEST(CouplingPassivityController, IsFiniteForAnyInputAndKeepsItsBalance) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  CouplingPassivityController controller;
  controller.apply(tool_at_x(0), force_x(-0.01), 0, kCouplingPassivityControllerPeriod);
  controller.apply(tool_at_x(0.01), {}, 0, kCouplingPassivityControllerPeriod);
  const double balance = controller.balance_j();
  ASSERT_GT(balance, 0);
  for (const double odd : {nan, infinity, -infinity}) {
    EXPECT_EQ(controller.apply(tool_at_x(odd), force_x(1), 0, kCouplingPassivityControllerPeriod).f.norm(), 0);
    EXPECT_EQ(controller.apply(tool_at_x(0.01), force_x(odd), 0, kCouplingPassivityControllerPeriod).f.norm(), 0);
    EXPECT_EQ(controller.apply(tool_at_x(0.01), force_x(1), 0, odd).f.norm(), 0);
    controller.apply(tool_at_x(0.01), {}, odd, kCouplingPassivityControllerPeriod);
    controller.set_displayed(force_x(odd));
    controller.apply(tool_at_x(0.01), {}, 0, kCouplingPassivityControllerPeriod);
    EXPECT_EQ(controller.balance_j(), balance);
  }
  Random random(test::test_seed(3), 0);
  for (int i = 0; i < 2000; ++i) {
    const auto number = [&] { return random.normal() * std::pow(10, random.uniform(-300, 300)); };
    const Pose X{Vec3(number(), number(), number()),
                 Quat(random.normal(), random.normal(), random.normal(), random.normal()).normalized()};
    const Wrench wanted{Vec3(number(), number(), number()), Vec3(number(), number(), number())};
    const Wrench shown = controller.apply(X, wanted, number(), kCouplingPassivityControllerPeriod);
    ASSERT_TRUE(is_finite(shown) && std::isfinite(controller.balance_j()) && std::isfinite(controller.withheld_j()))
        << "input " << i;
    ASSERT_LE(shown.f.cwiseAbs().maxCoeff(), wanted.f.cwiseAbs().maxCoeff());
  }
}

TEST(CouplingPassivityController, ForgetsAllOnReset) {
  CouplingPassivityController controller;
  controller.apply(tool_at_x(0), force_x(-0.01), 0, kCouplingPassivityControllerPeriod);
  controller.apply(tool_at_x(0.05), force_x(-100), 0, kCouplingPassivityControllerPeriod);
  EXPECT_NE(controller.balance_j(), 0);
  EXPECT_GT(controller.withheld_j(), 0);
  controller.reset();
  EXPECT_EQ(controller.balance_j(), 0);
  EXPECT_EQ(controller.withheld_j(), 0);
  controller.apply(tool_at_x(10), {}, 0,
                   kCouplingPassivityControllerPeriod);  // the jump from the pose before the reset does no work
  EXPECT_EQ(controller.balance_j(), 0);
}

TEST(CouplingPassivityController, AllocatesNothing) {
  CouplingPassivityController controller;
  const std::uint64_t before = test::allocation_count();
  for (int k = 0; k < 100; ++k)
    controller.apply(tool_at_x(k * 1e-4), force_x(-k), 1e-6, kCouplingPassivityControllerPeriod);
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace tandem::haptics
