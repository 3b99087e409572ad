#include "common/contact/contact_solver.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "common/base/random.hpp"
#include "tests/common/contact/touch_scene.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::contact {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

Vec3 random_push(Random& random, double scale) {
  return {random.uniform(-scale, scale), random.uniform(-scale, scale), random.uniform(-scale, scale)};
}

std::vector<ContactPoint> contacts_about(Random& random, const Vec3& p_W, const Vec3& normal_W, int count) {
  std::vector<ContactPoint> contacts;
  for (int i = 0; i < count; ++i) {
    contacts.push_back({p_W + random_push(random, 0.005), normal_W, random.uniform(-1e-4, 2e-4), 1e-6,
                        random_push(random, 1e-5), static_cast<std::uint32_t>(i)});
  }
  return contacts;
}

SolverBody body_at(Random& random, double mass_kg, const Vec3& p_WC) {
  SolverBody body;
  body.mass_kg = mass_kg;
  body.inertia_W = box_inertia(mass_kg, {0.02, 0.03, 0.01});
  body.p_WC = p_WC;
  body.V_WC = {random_push(random, 0.1), random_push(random, 1)};
  return body;
}

struct Momentum {
  Vec3 linear = Vec3::Zero();
  Vec3 angular = Vec3::Zero();  ///< angular momentum about the origin of W
};

Momentum momentum_of(std::span<const SolverBody> bodies) {
  Momentum sum;
  for (const SolverBody& body : bodies) {
    sum.linear += body.mass_kg * body.V_WC.v;
    sum.angular += body.inertia_W * body.V_WC.w + body.mass_kg * body.p_WC.cross(body.V_WC.v);
  }
  return sum;
}

TEST(ContactSolver, BodiesThatTouchKeepTheirTotalMomentum) {
  constexpr std::uint64_t kSeed = 17;
  Random random(kSeed);
  ContactSolver solver({});
  int touching = 0;
  for (int draw = 0; draw < 100; ++draw) {
    std::vector<SolverBody> bodies = {body_at(random, 0.05, {0.01, 0.02, 0.03}), body_at(random, 2, {0.01, 0.02, 0.05}),
                                      body_at(random, 0.3, {0.01, 0.04, 0.04})};
    std::vector<ContactPoint> first = contacts_about(random, {0.01, 0.02, 0.04}, -Vec3::UnitZ(), 31);
    std::vector<ContactPoint> second = contacts_about(random, {0.01, 0.03, 0.04}, Vec3::UnitY(), 12);
    const std::vector<SolverPatch> patches = {{0, 1, first}, {2, 0, second}};
    std::vector<PatchResult> results(2);
    const std::vector<SolverBody> before = bodies;
    const SolverReport report = solver.step(kStep_s, bodies, {}, patches, results, {});
    ASSERT_TRUE(report.has_converged) << "seed " << kSeed << " draw " << draw;
    const Momentum old = momentum_of(before), now = momentum_of(bodies);
    if (results[0].normal_force_n > 0 && results[1].normal_force_n > 0) ++touching;
    ASSERT_LT((now.linear - old.linear).norm(), 1e-9) << "seed " << kSeed << " draw " << draw;
    ASSERT_LT((now.angular - old.angular).norm(), 1e-10) << "seed " << kSeed << " draw " << draw;
    // The change of each body's velocity must follow from the reported wrenches. A wrench acts on body a of its patch;
    // body b receives the opposite wrench.
    const Vec3 on_second = -kStep_s * results[0].on_a_W.f;
    ASSERT_LT((2 * (bodies[1].V_WC.v - before[1].V_WC.v) - on_second).norm(), 1e-9);
    const Vec3 about_centre = results[1].on_a_W.t - bodies[2].p_WC.cross(results[1].on_a_W.f);
    ASSERT_LT((bodies[2].inertia_W * (bodies[2].V_WC.w - before[2].V_WC.w) - kStep_s * about_centre).norm(), 1e-10);
  }
  EXPECT_GT(touching, 30);
}

TEST(ContactSolver, APatchSeenFromItsOtherBodyMovesBothAlike) {
  constexpr std::uint64_t kSeed = 19;
  Random random(kSeed);
  ContactSolver solver({});
  std::vector<SolverBody> one = {body_at(random, 0.05, {0, 0, 0.01}), body_at(random, 0.5, {0, 0, -0.01})};
  std::vector<SolverBody> other = one;
  std::vector<ContactPoint> contacts = contacts_about(random, Vec3::Zero(), Vec3::UnitZ(), 40), turned = contacts;
  for (ContactPoint& contact : turned) {
    contact.normal_W = -contact.normal_W;
    contact.bristle_W = -contact.bristle_W;
  }
  PatchResult of_one, of_other;
  const SolverPatch forward{0, 1, contacts}, backward{1, 0, turned};
  solver.step(kStep_s, one, {}, {&forward, 1}, {&of_one, 1}, {});
  solver.step(kStep_s, other, {}, {&backward, 1}, {&of_other, 1}, {});
  EXPECT_LT((one[0].V_WC.v - other[0].V_WC.v).norm(), 1e-8);
  EXPECT_LT((one[1].V_WC.w - other[1].V_WC.w).norm(), 1e-6);
  EXPECT_LT((of_one.on_a_W.f + of_other.on_a_W.f).norm(), 1e-5 * of_one.on_a_W.f.norm());
}

/// Four contacts at the corners of a square of 1 cm.
std::vector<ContactPoint> square(double height_m, double depth_m) {
  std::vector<ContactPoint> contacts;
  for (const double x : {-0.005, 0.005}) {
    for (const double y : {-0.005, 0.005}) {
      contacts.push_back({{x, y, height_m}, Vec3::UnitZ(), depth_m, 1e-6, Vec3::Zero(), 0});
    }
  }
  return contacts;
}

TEST(ContactSolver, AHeavyBodyDoesNotDriveALightOneThroughTheFloor) {
  ContactSolver solver({});
  // A body of 2 kg lies on a body of 5 g, which lies on the floor. Both bodies are 1 cm high.
  std::vector<SolverBody> bodies(2);
  bodies[0] = {0.005, box_inertia(0.005, {0.01, 0.01, 0.01}), {0, 0, 0.005}, {}, {}};
  bodies[1] = {2, box_inertia(2, {0.01, 0.01, 0.01}), {0, 0, 0.016}, {{0, 0, -1}}, {}};
  for (int i = 0; i < 100; ++i) {
    std::vector<ContactPoint> below = square(0, 0.005 - bodies[0].p_WC.z());
    std::vector<ContactPoint> between = square(0.01, 0.01 - (bodies[1].p_WC.z() - bodies[0].p_WC.z()));
    const std::vector<SolverPatch> patches = {{0, kStaticBody, below}, {1, 0, between}};
    std::vector<PatchResult> results(2);
    ASSERT_TRUE(solver.step(kStep_s, bodies, {}, patches, results, {}).has_converged);
    for (SolverBody& body : bodies) body.p_WC += kStep_s * body.V_WC.v;
    ASSERT_GT(bodies[0].p_WC.z(), 0.005 - 7e-4) << "step " << i;
    ASSERT_GT(bodies[1].p_WC.z() - bodies[0].p_WC.z(), 0.01 - 7e-4) << "step " << i;
  }
}

TEST(ContactSolver, BodiesThatDoNotTouchDoNotFeelEachOther) {
  constexpr std::uint64_t kSeed = 31;
  Random random(kSeed);
  ContactSolver solver({});
  const std::vector<SolverBody> start = {body_at(random, 0.05, {0, 0, 0.01}), body_at(random, 0.5, {1, 0, 0.01})};
  std::vector<ContactPoint> mine = contacts_about(random, Vec3::Zero(), Vec3::UnitZ(), 25), mine_alone = mine;
  std::vector<ContactPoint> others = contacts_about(random, {1, 0, 0}, Vec3::UnitZ(), 25);
  std::vector<SolverBody> both = start, alone = {start[0]};
  const std::vector<SolverPatch> of_both = {{1, kStaticBody, others}, {0, kStaticBody, mine}};
  const SolverPatch of_one{0, kStaticBody, mine_alone};
  std::vector<PatchResult> results(2);
  solver.step(kStep_s, both, {}, of_both, results, {});
  solver.step(kStep_s, alone, {}, {&of_one, 1}, results, {});
  EXPECT_EQ(both[0].V_WC.v, alone[0].V_WC.v);
  EXPECT_EQ(both[0].V_WC.w, alone[0].V_WC.w);
}

TEST(ContactSolver, AFreeBodyMovesByItsOutsideWrenchAlone) {
  ContactSolver solver({});
  SolverBody body{
      0.1, box_inertia(0.1, {0.01, 0.02, 0.03}), {1, 2, 3}, {{1, 0, 0}, {0, 2, 0}}, {{0, 0.5, 0}, {0, 0, 1e-4}}};
  const Twist before = body.V_WC;
  solver.step(kStep_s, {&body, 1}, {}, {}, {}, {});
  EXPECT_LT((body.V_WC.v - before.v - Vec3(0, 0.005, 0)).norm(), 1e-12);
  EXPECT_NEAR(body.V_WC.w.z(), kStep_s * 1e-4 / body.inertia_W(2, 2), 1e-12);
}

TEST(ContactSolver, ABodyThatApproachesFeelsNothingBeforeItTouches) {
  ContactSolver solver({});
  for (const double gap_m : {1.01e-4, 0.99e-4}) {
    SolverBody body{0.05, box_inertia(0.05, {0.01, 0.01, 0.01}), {0, 0, 0.005}, {{0, 0, -0.1}}, {}};
    std::vector<ContactPoint> contacts = square(0, -gap_m);
    const SolverPatch patch{0, kStaticBody, contacts};
    PatchResult result;
    solver.step(kStep_s, {&body, 1}, {}, {&patch, 1}, {&result, 1}, {});
    EXPECT_EQ(result.pressing, gap_m > 1e-4 ? 0U : 4U);
  }
}

class WrongInput : public testing::Test {
 protected:
  /// Runs one step of a valid body on a floor together with the invalid input, which must not affect the body.
  void step_good_body() {
    step(SolverCoupling{0, law_.get(), {}, {}, {{0, 0, 0.005}, Quat::Identity()}},
         SolverPatch{0, kStaticBody, contacts_});
  }
  void step(const SolverCoupling& coupling, const SolverPatch& patch) {
    report_ = solver_.step(kStep_s, bodies_, {&coupling, 1}, {&patch, 1}, {&result_, 1}, {&tool_, 1});
    for (const SolverBody& body : bodies_) {
      EXPECT_TRUE(is_finite(body.V_WC));
    }
    EXPECT_TRUE(is_finite(result_.on_a_W));
    EXPECT_TRUE(is_finite(tool_));
    for (const ContactPoint& contact : contacts_) EXPECT_TRUE(is_finite(contact.bristle_W));
  }

  ContactSolver solver_{{}};
  std::unique_ptr<haptics::CouplingLaw> law_ = haptics::make_coupling_law("spring-damper", {});
  std::vector<ContactPoint> contacts_ = square(0, 1e-4);
  std::vector<SolverBody> bodies_ = {{0.05, box_inertia(0.05, {0.01, 0.01, 0.01}), {0, 0, 0.005}, {{0, 0, -0.1}}, {}}};
  PatchResult result_;
  Wrench tool_;
  SolverReport report_;
};

TEST_F(WrongInput, AHandleThatIsNotFiniteDoesNotPull) {
  step({0, law_.get(), {{kNan, 0, 0}, Quat::Identity()}, {}, {}}, {0, kStaticBody, contacts_});
  EXPECT_EQ(tool_.f.norm(), 0);
  EXPECT_EQ(report_.left_out, 1U);
  EXPECT_GT(result_.normal_force_n, 0);
}

TEST_F(WrongInput, ABodyThatIsNotFiniteStops) {
  for (const double mass_kg : {kNan, -1.0, 0.0}) {
    bodies_.resize(1);
    bodies_.push_back(bodies_[0]);
    bodies_[1].mass_kg = mass_kg;
    step_good_body();
    EXPECT_EQ(bodies_[1].V_WC.v.norm(), 0);
    EXPECT_EQ(report_.left_out, 1U);
    EXPECT_GT(result_.normal_force_n, 0);
  }
}

TEST_F(WrongInput, AnInertiaThatNoBodyHasIsRefused) {
  bodies_[0].inertia_W(1, 1) = -1e-6;
  step_good_body();
  EXPECT_EQ(report_.left_out, 3U);  // the body, its coupling and its patch are not used
  EXPECT_EQ(bodies_[0].V_WC.v.norm(), 0);
}

TEST_F(WrongInput, IndicesOfNoBodyAreLeftOut) {
  step({7, law_.get(), {}, {}, {}}, {-5, 9, contacts_});
  EXPECT_EQ(report_.left_out, 2U);
}

TEST_F(WrongInput, APatchOfABodyThatDoesNotExistIsNoFloor) {
  for (const auto& [a, b] : {std::pair(0, 9), {0, -5}, {9, 0}}) {
    step({0, law_.get(), {}, {}, {{0, 0, 0.005}, Quat::Identity()}}, {a, b, contacts_});
    EXPECT_EQ(report_.left_out, 1U) << a << " " << b;
    EXPECT_EQ(result_.normal_force_n, 0) << a << " " << b;
  }
}

TEST_F(WrongInput, ABrakeThatIsNotFiniteOrDrivesIsLeftOut) {
  for (const double brake : {kNan, -1.0}) {
    for (const bool is_torque : {false, true}) {
      SolverCoupling coupling{0, law_.get(), {}, {}, {{0, 0, 0.005}, Quat::Identity()}};
      (is_torque ? coupling.brake_n_m_s_per_rad : coupling.brake_n_s_per_m) = brake;
      step(coupling, {0, kStaticBody, contacts_});
      EXPECT_EQ(report_.left_out, 1U);
      EXPECT_TRUE(report_.has_converged);
      EXPECT_GT(result_.normal_force_n, 0) << "the remaining contacts must be used";
    }
  }
}

TEST_F(WrongInput, HugeNumbersStayFinite) {
  contacts_[0].depth_m = 1e200;
  contacts_[1].bristle_W.x() = 1e180;
  contacts_[2].p_W.x() = 1e250;
  bodies_[0].V_WC.v.x() = 1e160;
  step_good_body();
  EXPECT_TRUE(std::isfinite(result_.normal_force_n));
  EXPECT_FALSE(report_.has_converged);
}

TEST_F(WrongInput, AStepOfNoLengthChangesNothing) {
  const SolverPatch patch{0, kStaticBody, contacts_};
  const Vec3 before = bodies_[0].V_WC.v;
  EXPECT_FALSE(solver_.step(0, bodies_, {}, {&patch, 1}, {&result_, 1}, {}).has_converged);
  EXPECT_EQ(bodies_[0].V_WC.v, before);
  EXPECT_EQ(result_.normal_force_n, 0);
}

TEST(ContactSolver, ContactsBeyondItsLimitsAreCountedAndIgnored) {
  Random random(3);
  ContactSolver solver({.bodies = 1, .couplings = 1, .patches = 1, .contacts = 10, .iterations = 30});
  std::vector<SolverBody> bodies = {body_at(random, 0.1, {0, 0, 0.01}), body_at(random, 0.1, {0, 0, 0.02})};
  std::vector<ContactPoint> many = contacts_about(random, Vec3::Zero(), Vec3::UnitZ(), 13);
  const SolverPatch patch{0, kStaticBody, many};
  PatchResult result;
  EXPECT_EQ(solver.step(kStep_s, bodies, {}, {&patch, 1}, {&result, 1}, {}).left_out, 2U);
  EXPECT_EQ(result.normal_force_n, 0);
}

TEST(ContactSolver, StepsWithoutAllocating) {
  constexpr std::uint64_t kSeed = 41;
  Random random(kSeed);
  constexpr int kBodies = 24;
  ContactSolver solver({});
  const auto law = haptics::make_coupling_law("spring-damper", haptics::CouplingParameters{});
  std::vector<SolverBody> bodies;
  std::vector<std::vector<ContactPoint>> contacts;
  std::vector<SolverPatch> patches;
  for (int i = 0; i < kBodies; ++i) {
    bodies.push_back(body_at(random, 0.1, {0, 0, 0.02 * i}));
    contacts.push_back(contacts_about(random, {0, 0, 0.02 * i - 0.01}, Vec3::UnitZ(), 50));
  }
  for (int i = 0; i < kBodies; ++i) patches.push_back({i, i - 1, contacts[static_cast<std::size_t>(i)]});
  const SolverCoupling coupling{kBodies - 1, law.get(), {{0, 0.01, 0.5}, Quat::Identity()}, {}, {bodies.back().p_WC}};
  std::vector<PatchResult> results(kBodies);
  Wrench tool;
  const std::uint64_t before = test::allocation_count();
  SolverReport report;
  for (int i = 0; i < 5; ++i) report = solver.step(kStep_s, bodies, {&coupling, 1}, patches, results, {&tool, 1});
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_EQ(report.left_out, 0U);
}

TEST(ContactSolver, GivesTheSameBitsAgain) {
  const auto final_pose = [] {
    ContactSolver solver({});
    TouchScene scene(solver);
    scene.samples = sphere_samples(0.005, 500);
    scene.planes = {{}, {Vec3(1, 0, 0.2).normalized(), -0.006}};
    scene.gravity_m_per_s2 = kGravity_m_per_s2;
    scene.X_WB.p.z() = 0.01;
    scene.V_WB = {{-0.3, 0.1, 0}, {1, 2, 3}};
    scene.run(0.2);
    return scene.X_WB;
  };
  const Pose first = final_pose(), again = final_pose();
  EXPECT_EQ(first.p, again.p);
  EXPECT_EQ(first.q.coeffs(), again.q.coeffs());
}

class Prescribed : public testing::Test {
 protected:
  /// Runs one step with a square of contacts between two bodies: the prescribed body, which descends at
  /// `speed_m_per_s`, and the body `other`.
  PatchResult step(std::vector<SolverBody>& bodies, int other, double depth_m, double speed_m_per_s) {
    std::vector<ContactPoint> contacts = square(0, depth_m);
    bodies[0].is_prescribed = true;
    bodies[0].V_WC = {Vec3(0, 0, -speed_m_per_s), Vec3::Zero()};
    const SolverPatch patch{0, other, contacts, kStiffness_n_per_m3};
    PatchResult result;
    report_ = solver_.step(kStep_s, bodies, {}, {&patch, 1}, {&result, 1}, {});
    area_m2_ = 0;
    for (const ContactPoint& contact : contacts) area_m2_ += contact.area_m2;
    return result;
  }

  static constexpr double kStiffness_n_per_m3 = 1e8;
  ContactSolver solver_{{}};
  SolverReport report_;
  double area_m2_ = 0;
};

TEST_F(Prescribed, GoesOnWhateverPushesItAndIsPushedByTheLayerHoweverDeep) {
  for (const double depth_m : {1e-4, 5e-3}) {
    std::vector<SolverBody> bodies(1);
    const double speed_m_per_s = 0.02;
    const PatchResult result = step(bodies, kStaticBody, depth_m, speed_m_per_s);
    EXPECT_EQ(bodies[0].V_WC.v, Vec3(0, 0, -speed_m_per_s));
    const double lag_s = kStep_s + SolverPatch{}.dissipation_s;
    const double expected_n = kStiffness_n_per_m3 * area_m2_ * (depth_m + lag_s * speed_m_per_s);
    EXPECT_NEAR(result.normal_force_n, expected_n, 1e-9 * expected_n);
    EXPECT_NEAR(result.on_a_W.f.z(), expected_n, 1e-9 * expected_n);
    EXPECT_EQ(report_.left_out, 0U);
  }
}

TEST_F(Prescribed, PushesAMovingBodyWithTheReactionForce) {
  std::vector<SolverBody> bodies(2);
  bodies[1].mass_kg = 0.3;
  bodies[1].inertia_W = box_inertia(0.3, {0.02, 0.02, 0.02});
  bodies[1].p_WC = {0, 0, -0.01};
  const PatchResult result = step(bodies, 1, 1e-4, 0.1);
  EXPECT_LT(bodies[1].V_WC.v.z(), -1e-4);
  EXPECT_NEAR(0.3 * bodies[1].V_WC.v.z(), -kStep_s * result.on_a_W.f.z(), 1e-11);
  EXPECT_EQ(bodies[0].V_WC.v.z(), -0.1);
}

TEST_F(Prescribed, IsRefusedWhenItIsToGoNowhereFinite) {
  std::vector<SolverBody> bodies(1);
  step(bodies, kStaticBody, 1e-4, kNan);
  EXPECT_EQ(report_.left_out, 2U);  // the body and its patch are not used
  EXPECT_TRUE(is_finite(bodies[0].V_WC));
}

}  // namespace
}  // namespace tandem::contact
