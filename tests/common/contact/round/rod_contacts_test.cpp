// Compares contacts of rods with closed forms, and checks that their force does not jump at ends, corners and parallel
// axes.
#include "common/contact/round/rod_contacts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <numbers>
#include <set>
#include <vector>

#include "common/base/random.hpp"
#include "common/contact/contact_pair.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::contact {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLayer_n_per_m3 = 5e9;
constexpr double kRodBand_m = 5e-5;

/// Contact force and torque on A, which lies above B.
struct RodForce {
  Vec3 f = Vec3::Zero(), t = Vec3::Zero();
  double stiffness_n_per_m = 0;
};

RodForce force_of(const std::vector<ContactPoint>& contacts) {
  RodForce sum;
  for (const ContactPoint& contact : contacts) {
    if (!(contact.depth_m > 0)) continue;
    const Vec3 f = kLayer_n_per_m3 * contact.area_m2 * contact.depth_m * contact.normal_W;
    sum.f += f;
    sum.t += contact.p_W.cross(f);
    sum.stiffness_n_per_m += kLayer_n_per_m3 * contact.area_m2;
  }
  return sum;
}

std::vector<ContactPoint> rod_contacts(const Rod& a, const Pose& X_WA, const Rod& b, const Pose& X_WB = {}) {
  std::vector<ContactPoint> contacts;
  RodContacts pair;
  EXPECT_TRUE(pair.find(a, X_WA, b, X_WB, kRodBand_m, false, contacts));
  return contacts;
}

/// Pose of a rod whose centre is `distance_m` along x from the axis of a rod along z. The rod is rotated about x.
Pose across(double distance_m, double angle_rad, double along_m = 0) {
  return {Vec3(distance_m, 0, along_m), Quat(Eigen::AngleAxisd(angle_rad, Vec3::UnitX()))};
}

TEST(RodContacts, ThatCrossHaveTheForceAndStiffnessOfTheirOverlap) {
  for (const double radius_a_m : {1e-4, 5e-4, 1e-3}) {
    for (const double radius_b_m : {1e-4, 1e-3}) {
      for (const double degrees : {5.0, 20.0, 45.0, 90.0}) {
        const double depth_m = 0.2 * std::min(radius_a_m, radius_b_m), angle_rad = degrees * kPi / 180;
        const auto contacts = rod_contacts(
            {radius_a_m, 0.1, true}, across(radius_a_m + radius_b_m - depth_m, angle_rad), {radius_b_m, 0.1, true});
        const double round_m = std::sqrt(radius_a_m * radius_b_m) / std::sin(angle_rad);
        const RodForce found = force_of(contacts);
        const double force_n = kPi * kLayer_n_per_m3 * round_m * depth_m * depth_m;
        EXPECT_NEAR(found.f.x(), force_n, 0.003 * force_n) << degrees;
        EXPECT_LT(Vec3(0, found.f.y(), found.f.z()).norm(), 1e-9 * force_n);
        EXPECT_LT(found.t.norm(), 1e-9 * force_n) << "about the middle";
        EXPECT_NEAR(found.stiffness_n_per_m, 2 * force_n / depth_m, 0.01 * 2 * force_n / depth_m) << degrees;
      }
    }
  }
}

TEST(RodContacts, ThatAreParallelHaveTheForceOfALine) {
  for (const double degrees : {0.0, 1e-9, 1e-4}) {
    const double radius_m = 5e-4, depth_m = 1e-4, half_m = 0.01;
    const auto contacts =
        rod_contacts({radius_m, half_m, false}, across(2 * radius_m - depth_m, degrees * kPi / 180, 0.005),
                     {radius_m, half_m, false});
    const double force_n = 4.0 / 3 * kLayer_n_per_m3 * std::sqrt(radius_m) * std::pow(depth_m, 1.5) * 0.015;
    const RodForce found = force_of(contacts);
    EXPECT_NEAR(found.f.x(), force_n, 1e-4 * force_n) << degrees;
    EXPECT_NEAR(found.t.y(), force_n * 0.0025, 1e-4 * force_n * 0.0025)
        << "in the middle of where they are side by side";
  }
}

TEST(RodContacts, OfABallOnARodHaveTheForceOfTheirOverlap) {
  for (const double ball_m : {2e-4, 1e-3}) {
    for (const double rod_m : {1e-4, 1e-3}) {
      const double depth_m = 0.1 * std::min(ball_m, rod_m);
      const double force_n = kPi * kLayer_n_per_m3 * depth_m * depth_m * ball_m * std::sqrt(rod_m / (ball_m + rod_m));
      const Pose X_WA{Vec3(ball_m + rod_m - depth_m, 0, 0.003), Quat::Identity()};
      const Rod ball{ball_m, 0, true}, rod{rod_m, 0.01, true};
      EXPECT_NEAR(force_of(rod_contacts(ball, X_WA, rod)).f.x(), force_n, 1e-9 * force_n);
      EXPECT_NEAR(force_of(rod_contacts(rod, {}, ball, X_WA)).f.x(), -force_n, 1e-9 * force_n);
    }
  }
}

/// Rod A moves between two random poses close to rod B. Some poses are near the ends of B or nearly parallel to it.
struct RodScene {
  Rod a, b;
  Pose from, to;  ///< poses of A relative to B
};

RodScene rod_scene(Random& random, bool is_ball) {
  RodScene scene;
  scene.a = {1e-4 * std::pow(10, random.uniform(0, 1)), is_ball ? 0 : random.uniform(5e-4, 3e-3), true};
  scene.b = {1e-4 * std::pow(10, random.uniform(0, 1)), random.uniform(5e-4, 3e-3), true};
  const double sum_m = scene.a.radius_m + scene.b.radius_m;
  const Vec3 axis = random.uniform() < 0.5 ? Vec3(Vec3::UnitX())
                                           : Vec3(random.normal(), random.normal(), random.normal()).normalized();
  const auto pose = [&] {
    const double depth_m = random.uniform(0, 0.4) * std::min(scene.a.radius_m, scene.b.radius_m);
    const double turn_rad = random.uniform() < 0.5 ? random.uniform(-0.05, 0.05) : random.uniform(-kPi, kPi);
    return Pose{Vec3(sum_m - depth_m, random.uniform(-1, 1) * scene.a.half_length_m,
                     random.uniform(-1.3, 1.3) * (scene.b.half_length_m + scene.a.half_length_m)),
                Quat(Eigen::AngleAxisd(turn_rad, axis))};
  };
  scene.from = pose();
  scene.to = pose();
  return scene;
}

Pose between(const RodScene& scene, double share) {
  return {scene.from.p + share * (scene.to.p - scene.from.p), scene.from.q.slerp(share, scene.to.q)};
}

TEST(RodContacts, AreContinuousInThePose) {
  Random random(test::test_seed(1));
  double worst = 0;
  int pressing = 0;
  for (int i = 0; i < 500; ++i) {
    const RodScene scene = rod_scene(random, i % 4 == 0);
    const auto force_at = [&](double share) {
      const RodForce force = force_of(rod_contacts(scene.a, between(scene, share), scene.b));
      return Vec6((Vec6() << force.f, 1e3 * force.t).finished());
    };
    const int steps = 500;
    Vec6 before = force_at(0);
    for (int k = 1; k <= steps; ++k) {
      const Vec6 now = force_at(static_cast<double>(k) / steps);
      pressing += now.norm() > 1e-3 ? 1 : 0;
      if ((now - before).norm() > 1e-3) {
        // Bisects the interval with the largest change repeatedly. If the force is continuous, the change approaches
        // zero. If it jumps, the change stays as large as the jump.
        double low = (k - 1.0) / steps, high = static_cast<double>(k) / steps;
        Vec6 at_low = before, at_high = now;
        for (int halving = 0; halving < 30; ++halving) {
          const double middle = (low + high) / 2;
          const Vec6 at_middle = force_at(middle);
          if ((at_middle - at_low).norm() > (at_high - at_middle).norm()) {
            high = middle;
            at_high = at_middle;
          } else {
            low = middle;
            at_low = at_middle;
          }
        }
        // If the axes intersect, the direction of the normal may change abruptly. Such poses are skipped.
        const auto at_jump = rod_contacts(scene.a, between(scene, low), scene.b);
        const double deepest_m = std::ranges::max_element(at_jump, {}, &ContactPoint::depth_m)->depth_m;
        if (deepest_m > 0.7 * (scene.a.radius_m + scene.b.radius_m)) {
          before = now;
          continue;
        }
        const double jump = (at_high - at_low).norm();
        worst = std::max(worst, jump);
        EXPECT_LT(jump, 1e-4 + 1e-3 * at_low.norm())
            << "scene " << i << " at " << low << ", " << at_low.transpose() << " to " << at_high.transpose();
      }
      before = now;
    }
  }
  EXPECT_GT(pressing, 10'000);
  std::cout << pressing << " poses press, largest jump " << worst << " N\n";
}

TEST(RodContacts, HaveIdsThatAreTheirOwnAndLieWhereTheySay) {
  Random random(test::test_seed(2));
  for (int i = 0; i < 2000; ++i) {
    const RodScene scene = rod_scene(random, i % 4 == 0);
    const auto contacts = rod_contacts(scene.a, scene.from, scene.b);
    std::set<std::uint32_t> ids;
    for (const ContactPoint& contact : contacts) {
      EXPECT_TRUE(ids.insert(contact.id).second);
      EXPECT_LT(contact.id & ~ContactPoint::kClosedForm, kMaxRodContacts);
      EXPECT_NEAR(contact.normal_W.norm(), 1, 1e-9);
      EXPECT_GT(contact.area_m2, 0);
    }
    EXPECT_TRUE(std::ranges::is_sorted(contacts, {}, &ContactPoint::id));
  }
}

TEST(RodContacts, DoNotTurnRoundWhereARodIsMovedThroughTheOther) {
  const Rod rod{1e-4, 0.01, true};
  for (const double passed_m : {1e-5, 1e-4, 3e-4}) {
    RodContacts pair;
    std::vector<ContactPoint> contacts;
    ASSERT_TRUE(pair.find(rod, across(2.1e-4, 1), rod, {}, kRodBand_m, false, contacts));
    contacts.clear();
    ASSERT_TRUE(pair.find(rod, across(-passed_m + 1e-4, 1), rod, {}, kRodBand_m, false, contacts));
    const auto deepest = std::ranges::max_element(contacts, {}, &ContactPoint::depth_m);
    EXPECT_GT(deepest->normal_W.x(), 0.99);
    EXPECT_GT(deepest->depth_m, 0.9 * (1e-4 + passed_m));
    // Rod A is moved on until it no longer touches B. A rod without contact must change to its new side of B, so all
    // normals point along −x.
    contacts.clear();
    ASSERT_TRUE(pair.find(rod, across(-2.1e-4, 1), rod, {}, 1e-3, false, contacts));
    for (const ContactPoint& contact : contacts) EXPECT_LT(contact.normal_W.x(), 0);
  }
}

TEST(RodContacts, AreNoneOfAFlatEndThatPokesOrIsPoked) {
  const Rod pin{2e-4, 0.005, false}, rod{2e-4, 0.01, true}, post{0.006, 0.01, false};
  const auto is_found = [](const Rod& a, const Pose& X_WA, const Rod& b) {
    RodContacts pair;
    std::vector<ContactPoint> contacts;
    const bool is_one = pair.find(a, X_WA, b, {}, kRodBand_m, false, contacts);
    EXPECT_TRUE(is_one || contacts.empty());
    return is_one;
  };
  EXPECT_FALSE(is_found(pin, {Vec3(0.0051, 0, 0), Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitY()))}, rod));
  for (const double depth_m : {-1e-5, 0.0, 1e-4, 4e-4}) {
    for (const double aside_m : {0.0, 0.004, 0.0057}) {
      EXPECT_FALSE(is_found(pin, across(aside_m, 0, 0.015 - depth_m), post)) << "on top of a post";
      EXPECT_FALSE(is_found(pin, across(aside_m, 0.1, 0.015 - depth_m), post)) << "leaning";
      EXPECT_FALSE(is_found(rod, across(aside_m, 0, 0.0202 - depth_m), post)) << "with a round end";
    }
  }
  EXPECT_TRUE(is_found(pin, across(0.0061, 0, 0.012), post)) << "beside the post";
}

}  // namespace
}  // namespace tandem::contact
