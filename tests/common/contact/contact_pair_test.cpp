#include "common/contact/contact_pair.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <utility>

#include "common/contact/contact_reduction.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "tests/common/contact/hand_made_shell.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::contact {
namespace {

constexpr double kBand_m = 2e-4;

ContactShape sphere_shape(double radius_m = 0.01, int count = 6000) {
  return hand_made_shape(sphere_field(radius_m), PointShell::make(sphere_points(radius_m, count), 4.5e-4));
}

std::map<std::uint32_t, double> depths(std::span<const ContactPoint> contacts) {
  std::map<std::uint32_t, double> by_id;
  for (const ContactPoint& contact : contacts) by_id[contact.id] = contact.depth_m;
  return by_id;
}

// Reference for the search: stores the depth of each point of the shell that is within the search band, by the point's
// id.
void add_all_depths(const PointShell& shell, const DistanceField& field, const Pose& X_FP, std::uint32_t id_bits,
                    std::map<std::uint32_t, double>& by_id) {
  for (std::uint32_t i = 0; i < shell.points.size(); ++i) {
    const double depth = -field.distance_m(X_FP * shell.points[i].p_S.cast<double>());
    if (depth > -kBand_m) by_id[i | id_bits] = depth;
  }
}

double net_normal_force_n(std::span<const ContactPoint> contacts, double stiffness_n_per_m3 = 5e9) {
  double sum = 0;
  for (const ContactPoint& contact : contacts) {
    sum += stiffness_n_per_m3 * contact.area_m2 * std::max(0.0, contact.depth_m);
  }
  return sum;
}

// Returns the number of queries of the distance field.
double queries(const ContactWork& work) {
  return work.nodes + work.points;
}

double deepest_m(std::span<const ContactPoint> contacts) {
  double deepest = -1;
  for (const ContactPoint& contact : contacts) deepest = std::max(deepest, contact.depth_m);
  return deepest;
}

// A random path of a body over the surface of a 4 cm box and into the box. The path is smooth, except for a jump in
// every 97th step.
class Wander {
 public:
  explicit Wander(unsigned seed) : random_(seed) {}
  Pose next() {
    std::normal_distribution<double> normal;
    if (step_ % 97 == 0) {
      X_.p = Vec3(normal(random_), normal(random_), normal(random_)).normalized() * 0.029;
      v_ = 0.2 * std::pow(10.0, 0.5 * normal(random_)) * Vec3(normal(random_), normal(random_), normal(random_));
    }
    ++step_;
    v_ += Vec3(normal(random_), normal(random_), normal(random_)) * 0.02 - 4e-2 * X_.p;
    const Vec3 w(normal(random_), normal(random_), normal(random_));
    X_ = integrate(X_, {v_, 3 * w}, 1e-3);
    return X_;
  }

 private:
  std::mt19937 random_;
  int step_ = 0;
  Pose X_;
  Vec3 v_ = Vec3::Zero();
};

TEST(ContactPair, FindsEveryPointThatACheckOfAllPointsFinds) {
  const ContactShape sphere = sphere_shape();
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair pair(12'000);
  pair.bind(&sphere, &box);
  Wander wander(1);
  std::size_t found = 0;
  for (int i = 0; i < 600; ++i) {
    const Pose X_BA = wander.next();
    const Pose X_WB{Vec3(0.1, -0.2, 0.3), quaternion_of(Vec3(0.3, 1e-3 * i, 0.1))};
    const ContactWork work = pair.find(X_WB * X_BA, X_WB, kBand_m);
    ASSERT_FALSE(work.is_coarse);
    std::map<std::uint32_t, double> all;
    add_all_depths(sphere.shells.surface, *box.field, X_BA, 0, all);
    add_all_depths(box.shells.surface, *sphere.field, X_BA.inverse(), ContactPoint::kOtherDirection, all);
    const auto contacts = depths(pair.contacts());
    ASSERT_EQ(contacts.size(), pair.contacts().size()) << "two contacts have the same id";
    // Points at the limit of the band are not compared, because rounding decides whether they are found.
    for (const auto& [id, depth] : all) {
      if (depth > -kBand_m + 1e-9) {
        ASSERT_TRUE(contacts.contains(id)) << "step " << i << ", depth " << depth;
        ASSERT_NEAR(contacts.at(id), depth, 1e-12);
      }
    }
    for (const auto& [id, depth] : contacts) ASSERT_GT(depth, -kBand_m) << id;
    ASSERT_LE(contacts.size(), all.size() + 2);
    found += contacts.size();
  }
  EXPECT_GT(found, 10'000U) << "the path hardly touches";
}

TEST(ContactPair, TheResultDoesNotDependOnEarlierSearches) {
  const ContactShape sphere = sphere_shape();
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair old(12'000);
  ContactPair fresh(12'000);
  old.bind(&box, &sphere);
  Wander wander(2);
  for (int i = 0; i < 400; ++i) {
    const Pose X_BA = wander.next();
    fresh.bind(&box, &sphere);
    fresh.find(X_BA.inverse(), {}, kBand_m);
    old.find(X_BA.inverse(), {}, kBand_m);
    ASSERT_EQ(depths(old.contacts()), depths(fresh.contacts())) << "step " << i;
  }
}

TEST(ContactPair, KeepsContactsInTheOrderOfTheirIds) {
  const ContactShape a = box_shape(Vec3(0.03, 0.03, 0.03));
  const ContactShape b = box_shape(Vec3(0.04, 0.04, 0.04));
  for (const std::uint32_t budget : {4096U, 128U}) {
    ContactPair pair(budget);
    pair.bind(&a, &b);
    pair.find({Vec3(0.025, 0.01, 0.0348), Quat::Identity()}, {}, kBand_m);
    const auto contacts = pair.contacts();
    ASSERT_GT(contacts.size(), 20U);
    EXPECT_TRUE(contacts.front().id < ContactPoint::kOtherDirection);
    EXPECT_TRUE(contacts.back().id >= ContactPoint::kOtherDirection) << "an edge of b is in a";
    for (std::size_t i = 1; i < contacts.size(); ++i) ASSERT_LT(contacts[i - 1].id, contacts[i].id);
  }
}

TEST(ContactPair, NormalsPointOutOfBWhicheverShapeGivesThePoints) {
  const ContactShape small = sphere_shape(0.01);
  const ContactShape large = sphere_shape(0.02, 24000);
  const Pose X_small{Vec3(0.0, 0.0, 0.0298), quaternion_of(Vec3(0.4, 0.2, 0.1))};
  ContactPair pair(4096);
  ContactPair swapped(4096);
  pair.bind(&small, &large);
  swapped.bind(&large, &small);
  pair.find(X_small, {}, kBand_m);
  swapped.find({}, X_small, kBand_m);
  ASSERT_GT(pair.contacts().size(), 10U);
  ASSERT_EQ(depths(pair.contacts()), depths(swapped.contacts()));
  for (std::size_t i = 0; i < pair.contacts().size(); ++i) {
    const ContactPoint& contact = pair.contacts()[i];
    EXPECT_NEAR(contact.normal_W.norm(), 1, 1e-12);
    EXPECT_GT(contact.normal_W.z(), 0.9) << "out of the large sphere, towards the small one";
    EXPECT_LT((contact.normal_W + swapped.contacts()[i].normal_W).norm(), 1e-12);
    EXPECT_LT((contact.p_W - swapped.contacts()[i].p_W).norm(), 1e-12);
    const bool is_of_large = contact.id >= ContactPoint::kOtherDirection;
    const double radius_m = is_of_large ? contact.p_W.norm() - 0.02 : (contact.p_W - X_small.p).norm() - 0.01;
    EXPECT_NEAR(radius_m, 0, 1e-8) << "the point must lie on the shape whose point it is";
  }
}

TEST(ContactPair, TakesThePointsOfTheShapeThatIsSampledFinely) {
  const ContactShape fine = sphere_shape(0.02, 24000);
  ContactShape wide = sphere_shape(0.01, 500);
  wide.shells.surface.spacing_m = 2e-3;
  ContactPair pair(4096);
  pair.bind(&wide, &fine);
  pair.find({Vec3(0.0, 0.0, 0.0298), Quat::Identity()}, {}, kBand_m);
  ASSERT_FALSE(pair.contacts().empty());
  for (const ContactPoint& contact : pair.contacts()) EXPECT_NEAR(contact.p_W.norm(), 0.02, 1e-8);
}

TEST(ContactPair, RemembersMostOfTheTreeWhileShapesSlide) {
  const ContactShape sphere = sphere_shape();
  const ContactShape box = box_shape(Vec3(0.1, 0.1, 0.02), 1e-3);
  for (const auto& [speed_m_s, share] : {std::pair(0.01, 0.25), std::pair(0.1, 0.4), std::pair(1.0, 1.0)}) {
    ContactPair pair(2048);
    ContactPair fresh(2048);
    pair.bind(&sphere, &box);
    double work = 0;
    double fresh_work = 0;
    for (int i = 0; i < 80; ++i) {
      const Pose X_WA{Vec3(-0.04 + 1e-3 * speed_m_s * i, 0, 0.0199), quaternion_of(Vec3(0, 1e-3 * i, 0))};
      work += queries(pair.find(X_WA, {}, kBand_m));
      fresh.bind(&sphere, &box);
      fresh_work += queries(fresh.find(X_WA, {}, kBand_m));
      ASSERT_GT(deepest_m(pair.contacts()), 5e-5);
    }
    EXPECT_LT(work, share * fresh_work) << speed_m_s << " m/s";
  }
}

TEST(ContactPair, DoesNothingWhileTheGapIsNotUsedUp) {
  const ContactShape sphere = sphere_shape();
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair pair(2048);
  pair.bind(&sphere, &box);
  EXPECT_TRUE(pair.find({Vec3(0.2, 0, 0), Quat::Identity()}, {}, kBand_m).is_refreshed);
  for (int i = 1; i < 40; ++i) {
    const Pose X_WA{Vec3(0.2 - 1e-3 * i, 0, 0), quaternion_of(Vec3(0, 0.02 * i, 0))};
    const ContactWork work = pair.find(X_WA, {}, kBand_m);
    EXPECT_EQ(work.nodes + work.points, 0U) << "step " << i;
  }
}

TEST(ContactPair, SmallToolMayTurnOnALargeTable) {
  const ContactShape tool = sphere_shape();
  const ContactShape table = box_shape(Vec3(0.5, 0.5, 0.02), 4e-3);
  ContactPair pair(2048);
  pair.bind(&tool, &table);
  double work = 0;
  double first_work = 0;
  for (int i = 0; i < 100; ++i) {
    // The tool rotates, 0.2 m from the table's origin. Seen from the tool, the table's points move far, although the
    // tool hardly moves relative to the points below it. Fails if the search bounds the motion only in the tool's
    // frame: it would query all points again in each step.
    const Pose X_WA{Vec3(0.2, 0.1, 0.0199), quaternion_of(Vec3(0, 0, 2e-3 * i))};
    (i == 0 ? first_work : work) += queries(pair.find(X_WA, {}, kBand_m));
    ASSERT_NEAR(deepest_m(pair.contacts()), 1e-4, 2e-5);
  }
  EXPECT_LT(work / 99, 0.25 * first_work) << "later searches must query little more than the nearest points";
}

TEST(ContactPair, OverBudgetAFaceKeepsItsForceAndMoment) {
  const ContactShape block = without_flat_parts(box_shape(Vec3(0.04, 0.04, 0.01), 4e-4));
  const ContactShape table = box_shape(Vec3(0.5, 0.5, 0.02), 4e-3);
  ContactPair all(40'000);
  ContactPair few(kContactBudget);
  all.bind(&block, &table);
  few.bind(&block, &table);
  for (const double tilt_rad : {0.0, 2e-3, 4e-3}) {
    const Pose X_WA{Vec3(0.03, 0.01, 0.015 - 1e-4), quaternion_of(Vec3(0, tilt_rad, 0))};
    const ContactWork fine = all.find(X_WA, {}, kBand_m);
    const ContactWork coarse = few.find(X_WA, {}, kBand_m);
    EXPECT_FALSE(fine.is_coarse);
    EXPECT_TRUE(coarse.is_coarse) << tilt_rad;
    EXPECT_GT(all.contacts().size(), kContactBudget);
    EXPECT_LE(few.contacts().size(), kContactBudget);
    const double force_n = net_normal_force_n(all.contacts());
    EXPECT_NEAR(net_normal_force_n(few.contacts()), force_n, 0.02 * force_n) << tilt_rad;
    Vec3 moment_fine = Vec3::Zero();
    Vec3 moment_coarse = Vec3::Zero();
    for (const ContactPoint& c : all.contacts()) {
      moment_fine += 5e9 * c.area_m2 * std::max(0.0, c.depth_m) * (c.p_W - X_WA.p).cross(c.normal_W);
    }
    for (const ContactPoint& c : few.contacts()) {
      moment_coarse += 5e9 * c.area_m2 * std::max(0.0, c.depth_m) * (c.p_W - X_WA.p).cross(c.normal_W);
    }
    EXPECT_LT((moment_coarse - moment_fine).norm(), 0.02 * (moment_fine.norm() + force_n * 0.02)) << tilt_rad;
  }
}

TEST(ContactPair, OverBudgetTheDeepestPlaceIsStillFound) {
  // The sphere is deep inside the box, so all of its points are near. The search must merge most of them, and could
  // lose the deepest one.
  const ContactShape sphere = sphere_shape(0.01, 24'000);
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair all(40'000);
  ContactPair few(512);
  all.bind(&sphere, &box);
  few.bind(&sphere, &box);
  for (const double z_m : {0.028, 0.024, 0.016}) {
    const Pose X_WA{Vec3(0.001, 0.002, z_m), Quat::Identity()};
    all.find(X_WA, {}, kBand_m);
    EXPECT_TRUE(few.find(X_WA, {}, kBand_m).is_coarse);
    EXPECT_LE(few.contacts().size(), 512U);
    const double deepest = deepest_m(all.contacts());
    EXPECT_NEAR(deepest_m(few.contacts()), deepest, 0.05 * deepest) << z_m;
    const double force_n = net_normal_force_n(all.contacts());
    EXPECT_NEAR(net_normal_force_n(few.contacts()), force_n, 0.05 * force_n) << z_m;
  }
}

// Returns the number of leaves of the shell's tree that have a point deeper than `depth_m`, and the number of such
// points.
std::pair<std::size_t, std::size_t> count_deep(const PointShell& shell, const DistanceField& field, const Pose& X_FP,
                                               double depth_m) {
  std::size_t leaves = 0;
  std::size_t points = 0;
  for (const ShellNode& node : shell.nodes) {
    std::size_t deep = 0;
    for (std::uint32_t i = node.first; node.is_leaf && i < node.first + node.count; ++i) {
      if (field.distance_m(X_FP * shell.points[i].p_S.cast<double>()) < -depth_m) ++deep;
    }
    leaves += deep > 0 ? 1 : 0;
    points += deep;
  }
  return {leaves, points};
}

TEST(ContactPair, ParallelSurfacesTakeLeavesForPoints) {
  const ContactShape block = without_flat_parts(box_shape(Vec3(0.02, 0.02, 0.01), 4e-4));
  const ContactShape table = without_flat_parts(box_shape(Vec3(0.04, 0.04, 0.02), 4e-4));
  constexpr std::uint32_t kBudget = 2048;
  ContactPair pair(kBudget);
  pair.bind(&block, &table);
  const double stiffness_n_per_m = 5e9 * 0.02 * 0.02;
  for (const double tilt_rad : {0.0, 1e-4, 1e-3, 4e-3}) {
    const Pose X_WA{Vec3(0.001, 0.002, 0.015 - 1e-4), quaternion_of(Vec3(0, tilt_rad, 0))};
    const bool is_coarse = pair.find(X_WA, {}, kBand_m).is_coarse;
    EXPECT_LE(pair.contacts().size(), kBudget);
    if (tilt_rad == 0) {
      EXPECT_FALSE(is_coarse);
      const auto of_block = count_deep(block.shells.surface, *table.field, X_WA, 9e-5);
      const auto of_table = count_deep(table.shells.surface, *block.field, X_WA.inverse(), 9e-5);
      const auto pressing = std::count_if(pair.contacts().begin(), pair.contacts().end(),
                                          [](const ContactPoint& contact) { return contact.depth_m > 9e-5; });
      EXPECT_GT(of_block.second + of_table.second, 4800U);
      // Expected: one contact for each leaf. The limit is 30 % higher, because some leaves of the table extend beyond
      // the edge of the block's face and need several contacts.
      EXPECT_LT(pressing, 1.3 * (of_block.first + of_table.first)) << "more than one a leaf";
    }
    // The expected moment is linear in the tilt. This is valid below 10 mrad; with a larger tilt, the far side of the
    // block would lift off.
    const ContactWrench net = contact_wrench(pair.contacts(), 5e9, X_WA.p);
    const double moment_n_m = stiffness_n_per_m * tilt_rad * 0.02 * 0.02 / 12;
    EXPECT_NEAR(net.on_a_W.f.z(), stiffness_n_per_m * 1e-4, 0.02 * stiffness_n_per_m * 1e-4) << tilt_rad;
    EXPECT_NEAR(net.on_a_W.t.y(), -moment_n_m, 0.05 * moment_n_m + 1e-2 * stiffness_n_per_m * 1e-4 * 0.01) << tilt_rad;
  }
}

TEST(ContactPair, ABluntTipBetweenTheOthersPointsIsFound) {
  const ContactShape tip = sphere_shape(1e-3, 400);
  const ContactShape face = box_shape(Vec3(0.02, 0.02, 0.02), 4e-4);
  ContactPair pair(2048);
  for (const ContactShape* a : {&tip, &face}) {
    const ContactShape* b = a == &tip ? &face : &tip;
    pair.bind(a, b);
    for (int i = 0; i < 20; ++i) {
      const Pose X_tip{Vec3(1e-4 * i, 3e-5 * i, 0.01 + 1e-3 - 3e-4), quaternion_of(Vec3(0.1 * i, 0.2 * i, 0))};
      a == &tip ? pair.find(X_tip, {}, kBand_m) : pair.find({}, X_tip, kBand_m);
      EXPECT_NEAR(deepest_m(pair.contacts()), 3e-4, 1e-4) << i;
    }
  }
}

TEST(ContactPair, OverBudgetTheDeepestPointIsNearThatOfAllPoints) {
  const ContactShape sphere = sphere_shape(0.01, 24'000);
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair pair(256);
  for (int i = 0; i < 20; ++i) {
    const Pose X_BA{Vec3(1e-4 * i, 2e-4 * i, 0.0285 - 1e-4 * i), quaternion_of(Vec3(0.1 * i, 0, 0.3))};
    pair.bind(&sphere, &box);
    ASSERT_TRUE(pair.find(X_BA, {}, kBand_m).is_coarse);
    std::map<std::uint32_t, double> all;
    add_all_depths(sphere.shells.surface, *box.field, X_BA, 0, all);
    add_all_depths(box.shells.surface, *sphere.field, X_BA.inverse(), ContactPoint::kOtherDirection, all);
    double deepest = 0;
    for (const auto& [id, depth] : all) deepest = std::max(deepest, depth);
    EXPECT_NEAR(deepest_m(pair.contacts()), deepest, 0.2 * deepest) << i;
  }
}

TEST(ContactPair, CoarseAndFineDoNotAlternateAtTheBudget) {
  const ContactShape sphere = sphere_shape(0.01, 24'000);
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair counter(40'000);
  counter.bind(&sphere, &box);
  const auto pose = [](int i) { return Pose{Vec3(0, 0, 0.0297 + 2e-5 * std::sin(1.3 * i)), Quat::Identity()}; };
  counter.find(pose(0), {}, kBand_m + 2e-4);
  ContactPair pair(static_cast<std::uint32_t>(counter.contacts().size() * 4 / 3));
  pair.bind(&sphere, &box);
  int changes = 0;
  bool was_coarse = false;
  for (int i = 0; i < 300; ++i) {
    const bool is_coarse = pair.find(pose(i), {}, kBand_m).is_coarse;
    changes += is_coarse != was_coarse ? 1 : 0;
    was_coarse = is_coarse;
  }
  EXPECT_LE(changes, 2);
}

TEST(ContactPair, BristlesTurnWithBAndStayTangential) {
  const ContactShape sphere = sphere_shape();
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair pair(2048);
  pair.bind(&sphere, &box);
  const Pose X_BA{Vec3(0, 0, 0.0299), Quat::Identity()};
  pair.find(X_BA, {}, kBand_m);
  ASSERT_GT(pair.contacts().size(), 10U);
  for (ContactPoint& contact : pair.contacts()) {
    EXPECT_EQ(contact.bristle_W, Vec3::Zero());
    contact.bristle_W = Vec3(1e-5, 2e-5, 0);
  }
  const Pose X_WB{Vec3(0.3, 0, 0), quaternion_of(Vec3(0.2, -0.4, 0.3))};
  pair.find(X_WB * X_BA, X_WB, kBand_m);
  for (const ContactPoint& contact : pair.contacts()) {
    // The bristle (elastic tangential displacement) must be tangential to each contact's own normal. The normals
    // differ, because the sphere's surface curves away from the points of the box.
    const Vec3 turned_W = X_WB.q * Vec3(1e-5, 2e-5, 0);
    const Vec3 tangential_W = turned_W - contact.normal_W * contact.normal_W.dot(turned_W);
    EXPECT_LT((contact.bristle_W - tangential_W).norm(), 1e-15);
    EXPECT_NEAR(contact.bristle_W.dot(contact.normal_W), 0, 1e-18);
  }
}

TEST(ContactPair, DiscardsTheBristleOfAContactThatEnded) {
  const ContactShape sphere = sphere_shape();
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair pair(2048);
  pair.bind(&sphere, &box);
  const Pose X_in{Vec3(0, 0, 0.0299), Quat::Identity()};
  const Pose X_out{Vec3(0, 0, 0.0303), Quat::Identity()};
  pair.find(X_in, {}, kBand_m);
  ASSERT_FALSE(pair.contacts().empty());
  for (ContactPoint& contact : pair.contacts()) contact.bristle_W = Vec3(1e-5, 0, 0);
  pair.find(X_out, {}, kBand_m);
  EXPECT_TRUE(pair.contacts().empty());
  pair.find(X_in, {}, kBand_m);
  for (const ContactPoint& contact : pair.contacts()) EXPECT_EQ(contact.bristle_W, Vec3::Zero());
}

TEST(ContactPair, BristlesSurviveWhenPointsAreMerged) {
  const ContactShape block = without_flat_parts(box_shape(Vec3(0.04, 0.04, 0.01), 4e-4));
  const ContactShape table = box_shape(Vec3(0.5, 0.5, 0.02), 4e-3);
  ContactPair pair(2048);
  pair.bind(&block, &table);
  // The tilted box touches the table with an edge, and each point of the edge is one contact. When the box lies flat,
  // its face has more points than the budget, so the points are merged. The bristles (elastic tangential displacements)
  // must not be lost by the merging.
  const Pose X_tilted{Vec3(0, 0, 0.0205), quaternion_of(Vec3(0, 0.3, 0))};
  const Pose X_flat{Vec3(0, 0, 0.0149), Quat::Identity()};
  EXPECT_FALSE(pair.find(X_tilted, {}, kBand_m).is_coarse);
  ASSERT_FALSE(pair.contacts().empty());
  for (ContactPoint& contact : pair.contacts()) contact.bristle_W = Vec3(1e-5, 0, 0);
  EXPECT_TRUE(pair.find(X_flat, {}, kBand_m).is_coarse);
  double carried_area_m2 = 0;
  for (const ContactPoint& contact : pair.contacts()) {
    if (contact.bristle_W.x() > 0.9e-5) carried_area_m2 += contact.area_m2;
  }
  EXPECT_GT(carried_area_m2, 0.04 * 1e-3) << "of the strip that touched before";
}

TEST(ContactPair, APoseThatIsNotFiniteHasNoContacts) {
  const ContactShape sphere = sphere_shape();
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair pair(2048);
  pair.bind(&sphere, &box);
  const Pose X_in{Vec3(0, 0, 0.0299), Quat::Identity()};
  pair.find({Vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0), Quat::Identity()}, {}, kBand_m);
  EXPECT_TRUE(pair.contacts().empty());
  pair.find(X_in, {}, kBand_m);
  EXPECT_FALSE(pair.contacts().empty()) << "a pose that is not finite must not affect later searches";
}

TEST(ContactPair, OfFacesFitsIntoAnyRoomAndAllocatesNothing) {
  const ContactShape a = box_shape(Vec3(0.03, 0.03, 0.03));
  const ContactShape b = box_shape(Vec3(0.04, 0.04, 0.04));
  for (const std::uint32_t budget : {16U, 64U, 128U, 256U, 2048U}) {
    ContactPair pair(budget);
    pair.bind(&a, &b);
    std::mt19937 random(budget);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const std::uint64_t before = test::allocation_count();
    for (int i = 0; i < 400; ++i) {
      const double turn = std::pow(10.0, -4 + 4 * std::abs(uniform(random)));
      const Vec3 axis(uniform(random), uniform(random), 0.1 * uniform(random));
      const Pose X_WA{Vec3(0.02 * uniform(random), 0.02 * uniform(random), 0.035 - 2e-4 * std::abs(uniform(random))),
                      quaternion_of(turn * axis)};
      pair.find(X_WA, {}, i % 3 == 0 ? 1e-2 : kBand_m);
      const auto contacts = pair.contacts();
      ASSERT_LE(contacts.size(), budget) << i;
      for (std::size_t k = 1; k < contacts.size(); ++k) {
        ASSERT_LT(contacts[k - 1].id, contacts[k].id) << i << ", " << k;
      }
    }
    EXPECT_EQ(test::allocation_count(), before);
  }
}

TEST(ContactPair, AllocatesNothingAfterConstruction) {
  const ContactShape sphere = sphere_shape();
  const ContactShape box = box_shape(Vec3(0.04, 0.04, 0.04));
  ContactPair pair(128);
  Wander wander(5);
  bool was_coarse = false;
  const std::uint64_t before = test::allocation_count();
  pair.bind(&sphere, &box);
  for (int i = 0; i < 300; ++i) was_coarse = pair.find(wander.next(), {}, kBand_m).is_coarse || was_coarse;
  pair.bind(nullptr, nullptr);
  pair.find({}, {}, kBand_m);
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_TRUE(was_coarse) << "the path must exceed the budget at least once";
}

}  // namespace
}  // namespace tandem::contact
