// Tests the predicted pose of another user's hand. At rest it must equal the received pose. It yields to the model's
// forces, and follows a body that both users hold.
#include "client/model/partner.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "common/base/random.hpp"

namespace tandem::client {
namespace {

constexpr double kPeriod_s = 1e-3;
constexpr double kLate_s = 0.05;

RigidState moving_at(const Vec3& p, const Vec3& v = Vec3::Zero()) {
  return {{p, Quat::Identity()}, {v, Vec3::Zero()}};
}

/// A partner whose state arrives every millisecond with a delay of 50 ms.
class PartnerBench {
 public:
  RigidState tick(const RigidState& handle, const Wrench& shown_W, const PartnerSurroundings& around) {
    ++step_;
    proto::ServerUpdate update;
    update.step.value = step_;
    update.stepped = ServerTime(std::chrono::milliseconds(step_));
    partner.receive({.id = UserId{2},
                     .tool = handle,
                     .holds = BodyId{},
                     .tool_index = 1,
                     .has_handle = true,
                     .handle = handle,
                     .handle_age = Duration{0},
                     .on_hand_W = shown_W},
                    update);
    return partner.predict(update.stepped.time_since_epoch(), kLate_s, around, kPeriod_s);
  }

  Partner partner{UserId{2}};

 private:
  std::uint64_t step_ = 0;
};

PartnerSurroundings pushed_by(const Vec3& force) {
  PartnerSurroundings around;
  around.on_hand_W.f = force;
  return around;
}

TEST(GivingHand, ComesToRestWhereItsSpringBalancesTheForceForAnyPeriod) {
  for (const double period_s : {1e-4, 1e-3, 1e-2, 1.0}) {
    GivingHand hand;
    for (int k = 0; k < 20000; ++k) hand.step({{2, 0, 0}, {0, 0.1, 0}}, period_s);
    EXPECT_NEAR(hand.p().x(), 2 / GivingHand::kStiffness_n_per_m, 1e-9) << period_s;
    EXPECT_NEAR(hand.theta().y(), 0.1 / GivingHand::kStiffness_n_m_per_rad, 1e-9) << period_s;
    EXPECT_NEAR(hand.V().v.norm(), 0, 1e-9);
  }
}

/// A simulated hand of the given mass and stiffness. Force and target may change in every tick.
class Shaken {
 public:
  Shaken(double mass_kg, double stiffness_n_per_m) { hand_.set(mass_kg, stiffness_n_per_m); }
  /// Returns the position after `force` has acted for one millisecond, with the target `wanted`.
  Vec3 tick(const Vec3& force, const Vec3& wanted) {
    hand_.step({force, Vec3::Zero()}, kPeriod_s);
    return wanted + hand_.p();
  }

 private:
  GivingHand hand_;
};

TEST(HandEstimate, IdentifiesTheHandIfForcesShakeIt) {
  for (const auto& [mass_kg, stiffness_n_per_m] :
       {std::pair(0.07, 200.0), std::pair(1.3, 200.0), std::pair(0.3, 540.0)}) {
    Shaken hand(mass_kg, stiffness_n_per_m);
    HandEstimate estimate;
    for (int k = 0; k < 8000; ++k) {
      const double t = k * kPeriod_s;
      const Vec3 force(std::sin(9 * t), 0.5 * std::sin(17 * t), std::sin(30 * t));
      estimate.observe(hand.tick(force, {0.05 * std::sin(t), 0, 0}), force, kPeriod_s);
    }
    EXPECT_NEAR(std::log(estimate.mass_kg() / mass_kg), 0, 0.25) << mass_kg;
    EXPECT_NEAR(std::log(estimate.stiffness_n_per_m() / stiffness_n_per_m), 0, 0.25) << stiffness_n_per_m;
  }
}

TEST(HandEstimate, AssumesARelaxedHandWithoutForces) {
  HandEstimate estimate;
  for (int k = 0; k < 5000; ++k) estimate.observe({0.05 * std::sin(1e-3 * k), 0, 0}, Vec3::Zero(), kPeriod_s);
  EXPECT_NEAR(estimate.mass_kg(), GivingHand::kMass_kg, 1e-3);
  EXPECT_NEAR(estimate.stiffness_n_per_m(), GivingHand::kStiffness_n_per_m, 1);
}

TEST(Partner, AtRestIsAtTheReceivedPoseWhateverTheDisplayedForce) {
  for (const double newtons : {0.0, 1.0, 5.0}) {
    PartnerBench bench;
    const Vec3 force(newtons, 0, -newtons);
    RigidState handle;
    for (int k = 0; k < 5000; ++k)
      handle = bench.tick(moving_at({0.1, 0.2, 0.3}), {force, Vec3::Zero()}, pushed_by(force));
    EXPECT_LT((handle.X.p - Vec3(0.1, 0.2, 0.3)).norm(), 1e-6) << newtons;
    EXPECT_LT(handle.V.v.norm(), 1e-4);
  }
}

TEST(Partner, YieldsToTheModelBeforeTheForceCanHaveReachedTheUser) {
  PartnerBench bench;
  for (int k = 0; k < 1000; ++k) bench.tick(moving_at(Vec3::Zero()), {}, {});
  RigidState handle;
  for (int k = 0; k < 30; ++k) handle = bench.tick(moving_at(Vec3::Zero()), {}, pushed_by({1, 0, 0}));
  EXPECT_GT(handle.X.p.x(), 5e-4) << "an arm of 0.3 kg within 30 ms";
  for (int k = 0; k < 5000; ++k) handle = bench.tick(moving_at(Vec3::Zero()), {}, pushed_by({1, 0, 0}));
  EXPECT_NEAR(handle.X.p.x(), 1 / GivingHand::kStiffness_n_per_m, 1e-6);
}

TEST(Partner, IsForeseenWhereHeGoesLessWhereTheTwoTouchAndNotAtAllIfNotAskedFor) {
  static constexpr double kSpeed_m_per_s = 0.05;
  const auto ahead_m = [](const PartnerSurroundings& around) {
    PartnerBench bench;
    RigidState received_handle, handle;
    for (int k = 0; k < 1500; ++k) {
      received_handle = moving_at({kSpeed_m_per_s * kPeriod_s * k, 0, 0}, {kSpeed_m_per_s, 0, 0});
      handle = bench.tick(received_handle, {}, around);
    }
    return (handle.X.p - received_handle.X.p).x();
  };
  PartnerSurroundings coupled, unpredicted;
  coupled.is_coupled = true;
  unpredicted.is_predicted = false;
  const double free_m = ahead_m({}), coupled_m = ahead_m(coupled);
  EXPECT_GT(free_m, 0.7 * kSpeed_m_per_s * kLate_s);
  EXPECT_LT(free_m, kSpeed_m_per_s * kLate_s);
  EXPECT_GT(coupled_m, 0);
  EXPECT_LT(coupled_m, 0.9 * free_m);
  EXPECT_EQ(ahead_m(unpredicted), 0);
}

TEST(Partner, GoesAlongAcrossAndNotAlongThePressingDirection) {
  PartnerBench bench;
  PartnerSurroundings around;
  around.has_common_body = true;
  around.pressing_W = Vec3::UnitX();
  for (int k = 0; k < 1000; ++k) bench.tick(moving_at({0.02, 0, 0}), {}, around);
  // Since the last received state, the body has moved by 5 mm along the pressing direction and by 5 mm perpendicular to
  // it.
  around.body = moving_at({0.005, 0.005, 0});
  const RigidState handle = bench.tick(moving_at({0.02, 0, 0}), {}, around);
  EXPECT_NEAR(handle.X.p.x(), 0.02, 1e-6);
  EXPECT_GT(handle.X.p.y(), 0.001);
  EXPECT_LT(handle.X.p.y(), 0.005);
}

TEST(Partner, DiscardsTheHandleWhenNothingPullsTheTool) {
  PartnerBench bench;
  bench.tick(moving_at(Vec3::Zero()), {}, {});
  EXPECT_TRUE(bench.partner.has_handle());
  proto::ServerUpdate update;
  update.step.value = 2;
  bench.partner.receive({.id = UserId{2},
                         .tool = {},
                         .holds = BodyId{},
                         .tool_index = 1,
                         .has_handle = false,
                         .handle = {},
                         .handle_age = Duration{0},
                         .on_hand_W = {}},
                        update);
  EXPECT_FALSE(bench.partner.has_handle());
}

TEST(Partner, IsFiniteForFiniteInput) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  const auto any = [&random](double size) {
    return Vec3(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size));
  };
  PartnerBench bench;
  for (int k = 0; k < 3000; ++k) {
    PartnerSurroundings around = pushed_by(any(1e4));
    if (k % 3 == 0) {
      const Pose X_then{any(1e3), quaternion_of(any(3))};
      around.has_common_body = true;
      around.body = moving_at(any(1e3), any(1e3));
      around.X_WB_then = X_then;
      around.pressing_W = any(1).normalized();
      around.is_held = k % 2 == 0;
    }
    const RigidState handle = bench.tick(moving_at(any(1e3), any(1e3)), {any(1e4), any(1e4)}, around);
    ASSERT_TRUE(is_finite(handle)) << k;
    ASSERT_NEAR(handle.X.q.norm(), 1, 1e-9);
  }
}

}  // namespace
}  // namespace tandem::client
