// Compares landings and drops with a rigid stop and a free fall. Their evaluation is tested with springs in one
// dimension.
#include "lab/studies/contact/landing.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "lab/studies/contact/mesh_generators.hpp"

namespace tandem::lab {
namespace {

constexpr double kMass_kg = 0.1;
constexpr double kStep_s = 1e-3;
constexpr double kSpringStep_s = 1e-4;
constexpr double kEdge_m = 0.02;

/// Returns a cube that is prepared only once, because preparation is slow.
const TouchObject& landed_cube() {
  static const TouchObject object = make_touch_object("cube", make_cube(kEdge_m), VirtualClock{});
  return object;
}

/// Simulates one step of a tool in one dimension. The contact is a spring that acts below z = 0.
TouchStep spring_step(double& z_m, double& v_m_per_s, double stiffness_n_per_m, double push_n) {
  TouchStep step;
  step.contact_stored_j = 0.5 * stiffness_n_per_m * std::pow(std::min(z_m, 0.0), 2);
  step.contacts = z_m < 0 ? 1 : 0;
  const double force_n = stiffness_n_per_m * std::max(-z_m, 0.0), before_m_per_s = v_m_per_s;
  v_m_per_s += (force_n - push_n) / kMass_kg * kSpringStep_s;
  z_m += v_m_per_s * kSpringStep_s;
  step.contact_work_j = force_n * kSpringStep_s * (before_m_per_s + v_m_per_s) / 2;
  step.kinetic_j = 0.5 * kMass_kg * v_m_per_s * v_m_per_s;
  return step;
}

/// Returns the trace of a tool that is pressed with 1 N. While the tool moves outwards, the spring is stiffer by the
/// factor `harder`, which creates energy if it exceeds 1.
TouchTrace bounces(double speed_m_per_s, double harder) {
  TouchTrace trace;
  double z = 1e-3, v = -speed_m_per_s;
  for (int i = 0; i < 4000; ++i) trace.push_back(spring_step(z, v, v > 0 ? 1000 * harder : 1000, 1));
  return trace;
}

TEST(Landing, AnUndampedSpringLosesContactRepeatedlyAndCreatesNoEnergy) {
  const TouchFigures figures = quick_figures_of({bounces(0.1, 1)});
  EXPECT_GT(figures.separations, 1U);
  // The spring returns the energy that it stored, ½ k d² = ½ m v² + 1 N · (1 mm + d) = 4.5 mJ.
  // * k: stiffness of the spring
  // * m, v: mass and initial speed of the tool, which is pressed with 1 N from a height of 1 mm
  // * d = 3 mm: depth that the tool reaches
  const double taken_j = 4.5e-3;
  EXPECT_NEAR(figures.contact_returned_j, taken_j, 0.02 * taken_j);
  EXPECT_LT(figures.contact_created_j, 0.02 * taken_j);
}

TEST(Landing, ASpringThatPushesHarderThanItWasPushedIsSeenAsASource) {
  EXPECT_GT(quick_figures_of({bounces(0.3, 1.5)}).contact_created_j, 1e-3);
}

TEST(Landing, ContactIsLostAsOftenAsItEnds) {
  TouchTrace trace;
  for (const std::uint32_t contacts : {0U, 0U, 2U, 3U, 0U, 1U, 1U, 0U, 0U, 4U})
    trace.emplace_back().contacts = contacts;
  EXPECT_EQ(quick_figures_of({trace}).separations, 2U);
}

TEST(Landing, OfACubeOnItsFaceIsStoppedAsByARigidStop) {
  const TouchObject& cube = landed_cube();
  const std::vector<Landing> all = landings(cube, cube, -Vec3::UnitZ(), kMass_kg, VirtualClock{});
  ASSERT_EQ(all.size(), 6U);
  for (const Landing& landing : all) {
    const TouchFigures& figures = landing.figures;
    const double damping = 2 * 0.7 * std::sqrt(landing.stiffness_n_per_m * kMass_kg);
    EXPECT_NEAR(landing.stop_force_n, landing.speed_m_per_s * (damping + landing.stiffness_n_per_m * kStep_s), 1e-12);
    // Stopping the cube takes two steps of the simulation: the first one ends with the cube at the surface, the second
    // one stops it. The change of force is divided between both steps. Therefore the larger part is at least half of
    // it.
    const double ratio = figures.hand_force_step_max_n / landing.stop_force_n;
    EXPECT_GT(ratio, 0.5) << landing.name;
    EXPECT_LT(ratio, 1 + 1e-6) << landing.name;
    EXPECT_EQ(figures.separations, 0U) << landing.name;
    EXPECT_GT(figures.contacts_max, 0U) << landing.name;
    EXPECT_LT(landing.kinetic_left_j, 1e-9) << landing.name;
  }
  // A face that lies flat on the ground causes no torque.
  EXPECT_LT(all.front().figures.hand_torque_step_max_n_m, 1e-3 * all.front().stop_torque_n_m);
  // A solid cube with mass m and edge a has the moment of inertia I = m a²/6.
  const double gyration_m = kEdge_m / std::sqrt(6.0), inertia = kMass_kg * gyration_m * gyration_m;
  const double damping_r = 2 * 0.7 * std::sqrt(0.3 * inertia);
  EXPECT_NEAR(all.front().stop_torque_n_m, 0.022 / (2 * gyration_m) * (damping_r + 0.3 * kStep_s), 1e-6);
  EXPECT_TRUE(all_hold(landing_checks(all)));
}

TEST(Landing, OfACubeMetBesideItsCentreTurnsAsFastAsARigidStopTurnsIt) {
  const TouchObject& cube = landed_cube();
  // The cube is hit only on a strip of its lower face, centred at x = −8 mm in its frame. This lever arm is close to
  // a/√6 = 8.2 mm (a: edge of the cube), with which a stop causes the fastest rotation.
  const double lever_m = 0.008, gyration_m = kEdge_m / std::sqrt(6.0);
  TouchSettings settings;
  settings.coupling.stiffness_n_per_m = 1e-6;  // so soft that the tool moves freely
  settings.coupling.stiffness_n_m_per_rad = 0;
  RigidState start{{{2 * lever_m, 0, kEdge_m + 1e-3}, Quat::Identity()}, {{0, 0, -0.06}, Vec3::Zero()}};
  const TouchTrace trace = run_touch(
      *cube.shape, *cube.shape, [&](Duration) { return start; }, from_seconds(0.03), settings, VirtualClock{});
  double fastest_j = 0;
  for (const TouchStep& step : trace) fastest_j = std::max(fastest_j, step.kinetic_j);
  EXPECT_NEAR(fastest_j, 0.5 * kMass_kg * 0.06 * 0.06, 1e-9) << "it never gains";
  const auto turn = [&](std::size_t i) {
    return rotation_vector(trace[i].X_WT.q * trace[i - 1].X_WT.q.conjugate()).norm() / kStep_s;
  };
  double fastest_rad_per_s = 0;
  for (std::size_t i = 1; i < trace.size(); ++i) fastest_rad_per_s = std::max(fastest_rad_per_s, turn(i));
  EXPECT_LE(fastest_rad_per_s, 0.06 / (2 * gyration_m) * 1.01);
  EXPECT_GT(fastest_rad_per_s, 0.5 * 0.06 / (2 * gyration_m));
}

// Friction at a vertex acts as a soft spring. Fails if it returns more energy than it stored.
TEST(Landing, ACornerHeldByFrictionCreatesNoEnergy) {
  const TouchObject& cube = landed_cube();
  TouchSettings settings;
  settings.coupling.stiffness_n_per_m = 300;
  settings.friction = 10;
  settings.coupling.force_limit_n = settings.coupling.torque_limit_n_m = 1e6;
  RigidState start;
  start.X.q = Quat::FromTwoVectors(Vec3::Ones().normalized(), -Vec3::UnitZ());
  start.X.p = Vec3(0.003, 0.002, kEdge_m / 2 * (1 + std::sqrt(3.0)) + 1e-4);
  // The hand moves down for 0.1 s, sideways for 0.2 s, and back.
  const auto hand = [&](Duration at) {
    const double t = to_seconds(at), aside = std::clamp(1 - std::abs(t - 0.3) / 0.2, 0.0, 1.0);
    RigidState now = start;
    now.X.p += Vec3(0.006 * aside, 0, -0.1 * std::min(t, 0.1));
    return now;
  };
  const TouchTrace trace = run_touch(*cube.shape, *cube.shape, hand, from_seconds(1), settings, VirtualClock{});
  const TouchFigures figures = quick_figures_of({trace});
  EXPECT_GT(figures.contact_returned_j, 1e-4);
  EXPECT_LT(figures.contact_created_j, 0.05 * figures.contact_returned_j);
}

TEST(Drop, ACubeComesToRestAfterContactDissipatedTheWorkOfItsWeight) {
  const std::vector<Landing> all = drops(landed_cube(), kMass_kg, VirtualClock{});
  ASSERT_EQ(all.size(), 6U);
  const double fall_s = std::sqrt(2 * 0.005 / 9.81);
  for (const Landing& drop : all) {
    EXPECT_TRUE(drop.is_on_face) << drop.name;
    EXPECT_GT(drop.rest_s, fall_s - 2 * kStep_s) << drop.name;
    EXPECT_LT(drop.rest_s, 2 * fall_s) << drop.name;
    EXPECT_LT(drop.figures.contact_created_j, 1e-6) << drop.name;
    EXPECT_EQ(drop.figures.separations, 0U) << drop.name;
  }
  EXPECT_TRUE(all_hold(landing_checks(all)));
}

TEST(Drop, OfAConeIsOnAFaceWhereItsBaseIs) {
  geometry::TriangleMesh cone;
  cone.vertices = {{0, 0, 0.008}, {0.008, 0, -0.006}, {-0.004, 0.007, -0.006}, {-0.004, -0.007, -0.006}};
  cone.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  const TouchObject object = make_touch_object("cone", cone, VirtualClock{});
  const std::vector<Landing> all = drops(object, kMass_kg, VirtualClock{});
  for (const Landing& drop : all) {
    EXPECT_EQ(drop.is_on_face, drop.name == "drop on −z") << drop.name;
    EXPECT_LT(drop.figures.contact_created_j, 1e-4) << drop.name;
  }
  EXPECT_LT(all.back().rest_s, 0.1);
}

// A plate of one triangle. At first its longest side passes through the tool's origin: the plate tips over this side
// and is not on a face. Then the plate is shifted, so that the origin is above the triangle: the plate is on a face.
TEST(Drop, OfAPlateIsOnAFaceWhereItsMiddleIsAboveIt) {
  geometry::TriangleMesh plate;
  plate.vertices = {{-0.02, -0.02, 0}, {0.02, 0.02, 0}, {-0.02, 0.02, 0}};
  plate.triangles = {{0, 1, 2}};
  for (const bool is_above : {false, true}) {
    const TouchObject object = make_touch_object("plate", plate, VirtualClock{});
    for (const Landing& drop : drops(object, kMass_kg, VirtualClock{})) {
      const bool is_flat = drop.name.ends_with("z");
      EXPECT_EQ(drop.is_on_face, is_above && is_flat) << drop.name;
      if (!drop.is_on_face) continue;
      EXPECT_LT(drop.rest_s, 0.1) << drop.name;
    }
    for (Vec3& p : plate.vertices) p += Vec3(0.006, -0.006, 0);
  }
}

TEST(Drop, TheWorkOfContactEqualsThatOfTheWeightUntilRest) {
  const contact::ContactShape& cube = *landed_cube().shape;
  TouchSettings settings;
  settings.coupling.stiffness_n_per_m = settings.coupling.stiffness_n_m_per_rad = 0;
  settings.gravity_m_per_s2 = {0, 0, -9.81};
  const RigidState start{{{0.003, 0.002, kEdge_m + 0.005}, Quat::Identity()}, {}};
  const TouchTrace trace = run_touch(
      cube, cube, [&](Duration) { return start; }, from_seconds(0.3), settings, VirtualClock{});
  double work_j = 0;
  for (const TouchStep& step : trace) work_j += step.contact_work_j;
  EXPECT_NEAR(work_j, -kMass_kg * 9.81 * (start.X.p.z() - trace.back().X_WT.p.z()), 1e-9);
  EXPECT_NEAR(trace.back().X_WT.p.z(), kEdge_m, 1e-5);
}

TEST(Landing, ChecksFailBeyondTheirBoundsAndWithoutRest) {
  Landing landing;
  landing.speed_m_per_s = 0.06;
  landing.stop_force_n = landing.stop_torque_n_m = 1;
  landing.figures.hand_force_step_max_n = landing.figures.hand_torque_step_max_n_m = 1.09;
  landing.figures.contacts_max = 1;
  landing.figures.separations = 1;
  landing.figures.contact_created_j = 0.9e-3;
  Landing drop;
  drop.figures.contacts_max = 1;
  drop.rest_s = 1;
  drop.is_on_face = true;
  ASSERT_TRUE(all_hold(landing_checks({landing, drop})));
  const auto fails = [&](auto change) {
    Landing changed = landing, fallen = drop;
    change(changed, fallen);
    return !all_hold(landing_checks({changed, fallen}));
  };
  EXPECT_TRUE(fails([](Landing& one, Landing&) { one.figures.contacts_max = 0; }));
  EXPECT_TRUE(fails([](Landing&, Landing& one) { one.figures.contacts_max = 0; }));
  EXPECT_TRUE(fails([](Landing& one, Landing&) { one.figures.hand_force_step_max_n = 1.11; }));
  EXPECT_TRUE(fails([](Landing& one, Landing&) { one.figures.hand_torque_step_max_n_m = 1.11; }));
  EXPECT_TRUE(fails([](Landing& one, Landing&) { one.figures.separations = 2; }));
  EXPECT_TRUE(fails([](Landing& one, Landing&) { one.figures.contact_created_j = 1.1e-3; }));
  EXPECT_TRUE(fails([](Landing&, Landing& two) { two.figures.contact_created_j = 1.1e-3; }));
  EXPECT_TRUE(fails([](Landing&, Landing& two) { two.rest_s = std::numeric_limits<double>::infinity(); }));
}

}  // namespace
}  // namespace tandem::lab
