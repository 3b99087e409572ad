#include "common/contact/flat/ball_contacts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "common/contact/contact_pair.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "tests/common/contact/hand_made_shell.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/common/contact/touch_rig.hpp"

namespace tandem::contact {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kBallContactsBand_m = 2e-4;
constexpr double kBallContactsStiffness_n_per_m3 = 5e9;
const double kRadii_m[] = {1e-3, 5e-3, 2e-2, 1e-1};
const double kDepths_m[] = {1e-6, 1e-5, 5e-5, 1.2e-4, 4e-4, 1e-3};

template <typename Check>
void for_all_sizes(const Check& check) {
  for (const double radius_m : kRadii_m) {
    for (const double depth_m : kDepths_m) {
      if (depth_m > radius_m / 2) continue;
      SCOPED_TRACE("radius " + std::to_string(radius_m) + " m, depth " + std::to_string(depth_m * 1e6) + " um");
      check(radius_m, depth_m);
    }
  }
}

std::vector<ContactPoint> on_floor(double radius_m, double depth_m, double ball_share = 1,
                                   double band_m = kBallContactsBand_m) {
  std::vector<ContactPoint> contacts;
  const Vec3 centre(0, 0, radius_m - depth_m);
  add_ball_on_plane(FieldPlane{}, {}, centre, radius_m, band_m, ball_share, 1, contacts);
  return contacts;
}

double sum_of(const std::vector<ContactPoint>& contacts, const auto& term) {
  double sum = 0;
  for (const ContactPoint& contact : contacts) {
    if (contact.depth_m > 0) sum += contact.area_m2 * term(contact);
  }
  return sum;
}

/// Returns the integral of term(depth, distance from the axis) over the part of the sphere below the plane.
double integral(double radius_m, double depth_m, const auto& term) {
  const int steps = 20'000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    // The steps are uniform in the square root of the height, because the integrand is smooth in this variable.
    const double root = (i + 0.5) / steps, height_m = depth_m * root * root;
    const double area_m2 = 2 * kPi * radius_m * depth_m * 2 * root / steps;
    sum += area_m2 * term(depth_m - height_m, std::sqrt(height_m * (2 * radius_m - height_m)));
  }
  return sum;
}

TEST(BallContacts, HaveTheForceStiffnessTiltAndSlipOfTheCap) {
  for_all_sizes([](double radius_m, double depth_m) {
    const auto contacts = on_floor(radius_m, depth_m);
    EXPECT_LE(contacts.size(), kMaxBallContacts);
    const double volume_m3 = sum_of(contacts, [](const ContactPoint& c) { return c.depth_m; });
    const double area_m2 = sum_of(contacts, [](const ContactPoint&) { return 1.0; });
    const double u_m4 = sum_of(contacts, [](const ContactPoint& c) { return c.p_W.x() * c.p_W.x(); });
    const double v_m4 = sum_of(contacts, [](const ContactPoint& c) { return c.p_W.y() * c.p_W.y(); });
    const double slip_m4 = sum_of(contacts, [](const ContactPoint& c) { return c.depth_m * c.p_W.head<2>().norm(); });
    // The volume is a small difference of two large lengths, so its relative rounding error is large.
    const double rounding = 1e-12 + 4e-16 * radius_m / depth_m;
    EXPECT_NEAR(volume_m3 / (kPi * radius_m * depth_m * depth_m), 1, rounding);
    EXPECT_NEAR(area_m2 / (2 * kPi * radius_m * depth_m), 1, rounding);
    const double tilt_m4 = integral(radius_m, depth_m, [](double, double r) { return r * r / 2; });
    EXPECT_NEAR(u_m4 / tilt_m4, 1, 1e-7);
    EXPECT_NEAR(v_m4 / tilt_m4, 1, 1e-7);
    const double slip = integral(radius_m, depth_m, [](double depth, double r) { return depth * r; });
    EXPECT_NEAR(slip_m4 / slip, 1, 1e-5 + 0.1 * depth_m / radius_m);
    EXPECT_NEAR(sum_of(contacts, [](const ContactPoint& c) { return c.p_W.x(); }), 0, 1e-12 * area_m2);
    EXPECT_NEAR(sum_of(contacts, [](const ContactPoint& c) { return c.p_W.y(); }), 0, 1e-12 * area_m2);
  });
}

TEST(BallContacts, HaveTheForceOfThePlanesPointsToo) {
  for_all_sizes([](double radius_m, double depth_m) {
    // Reference: an integral over the points of the plane. A point at the distance s from the ball's centre has the
    // depth R − s, with the ball's radius R. Its normal points to the centre.
    const double height_m = radius_m - depth_m;
    const int steps = 20'000;
    double force_n = 0;
    for (int i = 0; i < steps; ++i) {
      const double s = height_m + depth_m * (i + 0.5) / steps;
      force_n += kBallContactsStiffness_n_per_m3 * (radius_m - s) * height_m / s * 2 * kPi * s * depth_m / steps;
    }
    const auto force_of = [&](double ball_share) {
      return kBallContactsStiffness_n_per_m3 *
             sum_of(on_floor(radius_m, depth_m, ball_share), [](const ContactPoint& c) { return c.depth_m; });
    };
    EXPECT_NEAR(force_of(0) / force_n, 1, 1e-7);
    EXPECT_NEAR(force_of(0.5) / (0.5 * (force_n + force_of(1))), 1, 1e-7);
  });
}

TEST(BallContacts, LieWhereTheyAreAsDeepAsTheySay) {
  for_all_sizes([](double radius_m, double depth_m) {
    for (const ContactPoint& contact : on_floor(radius_m, depth_m)) {
      EXPECT_NEAR(contact.depth_m, -contact.p_W.z(), 1e-12);
      EXPECT_LT(contact.p_W.head<2>().norm(), std::sqrt(2 * radius_m * depth_m));
    }
    // The first contact represents the deepest point and may be too shallow by at most 8 µm. Before the ball touches,
    // the same bound holds for the gap of the nearest point.
    EXPECT_LE(depth_m - on_floor(radius_m, depth_m)[0].depth_m, 8e-6 + 1e-12);
    EXPECT_LE(-depth_m - on_floor(radius_m, -depth_m, 1, 2e-3)[0].depth_m, 8e-6 + 1e-12);
  });
}

TEST(BallContacts, TheirAreasSumToThatOfTheCapInTheBand) {
  for (const double radius_m : kRadii_m) {
    for (const double band_m : {2e-4, 2e-3, 1e-2}) {
      for (const double depth_m : {2e-4, 0.0, -1e-6, -1e-4, -1.9e-4}) {
        double area_m2 = 0;
        const auto contacts = on_floor(radius_m, depth_m, 1, band_m);
        for (const ContactPoint& contact : contacts) area_m2 += contact.area_m2;
        const double cap_m = std::min(depth_m + band_m, radius_m);
        EXPECT_NEAR(area_m2 / (2 * kPi * radius_m * cap_m), 1, 1e-9);
        EXPECT_LE(contacts.size(), kMaxBallContacts);
        for (std::size_t i = 1; i < contacts.size(); ++i) EXPECT_LT(contacts[i - 1].id, contacts[i].id);
      }
    }
  }
}

/// Returns a ball that has few points but declares a fine spacing. Contacts must follow from the closed form; contacts
/// at the few points would fail the tests.
ContactShape ball_of(double radius_m, double spacing_m = 4.5e-4) {
  ContactShape shape =
      hand_made_shape(sphere_field(radius_m), PointShell::make(sphere_points(radius_m, 2000), spacing_m));
  shape.ball_radius_m = radius_m;
  return shape;
}

ContactShape box_of(double edge_m, double spacing_m = 4.5e-4) {
  const Vec3 size_m = Vec3::Constant(edge_m);
  return hand_made_shape(box_field(size_m), PointShell::make(box_points(size_m, edge_m / 20), spacing_m));
}

/// Force on A and its friction component [N], and the moment of friction [N·m] about the vertical line through the
/// centre of pressure.
struct Touch {
  Vec3 force_W = Vec3::Zero(), friction_W = Vec3::Zero();
  double moment_z = 0;
  bool is_closed_form = false;

  explicit Touch(const ContactPair& pair) {
    Vec3 centre = Vec3::Zero();
    double weights = 0;
    for (const ContactPoint& c : pair.contacts()) {
      const double depth = std::max(0.0, c.depth_m);
      force_W += kBallContactsStiffness_n_per_m3 * c.area_m2 * depth * c.normal_W;
      centre += c.area_m2 * depth * c.p_W;
      weights += c.area_m2 * depth;
      is_closed_form = is_closed_form || (c.id & ContactPoint::kClosedForm) != 0;
    }
    if (weights > 0) centre /= weights;
    for (const ContactPoint& c : pair.contacts()) {
      const Vec3 force = -kTangentialRatio * kBallContactsStiffness_n_per_m3 * c.area_m2 * c.bristle_W;
      friction_W += force;
      moment_z += (c.p_W - centre).cross(force).z();
    }
  }
};

TEST(BallContacts, OfAPairAreAsManyShellsOfBothWouldTendTo) {
  const double radius_m = 5e-3, depth_m = 1e-4, edge_m = 0.04;
  const double of_ball_n = kBallContactsStiffness_n_per_m3 * kPi * radius_m * depth_m * depth_m;
  const double of_plane_n = of_ball_n * (1 - depth_m / radius_m);
  const Pose X_WB{Vec3(0.3, -0.2, 0.1), quaternion_of(Vec3(0.4, 1.2, -0.7))};
  for (const auto& [of_ball, of_box, force_n] :
       {std::tuple(4e-4, 4e-4, (of_ball_n + of_plane_n) / 2), {4e-4, 2e-3, of_ball_n}, {2e-3, 4e-4, of_plane_n}}) {
    const ContactShape ball = ball_of(radius_m, of_ball), box = box_of(edge_m, of_box);
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {1.0, -1.0}) {
        Vec3 p_B = Vec3(0.004, -0.003, 0.002);
        p_B[axis] = side * (edge_m / 2 + radius_m - depth_m);
        const Pose X_WA{X_WB * p_B, quaternion_of(Vec3(1, 2, 3))};
        ContactPair above, below;
        above.bind(&ball, &box);
        below.bind(&box, &ball);
        above.find(X_WA, X_WB, kBallContactsBand_m);
        below.find(X_WB, X_WA, kBallContactsBand_m);
        ASSERT_TRUE(Touch(above).is_closed_form);
        const Vec3 expected = force_n * side * (X_WB.q * Vec3::Unit(axis));
        EXPECT_LT((Touch(above).force_W - expected).norm(), 1e-9 * force_n);
        EXPECT_LT((Touch(below).force_W + expected).norm(), 1e-9 * force_n);
      }
    }
  }
}

TEST(BallContacts, AreContinuousWhenABallIsPressedDown) {
  for (const double radius_m : kRadii_m) {
    const double step_m = 1e-7;
    const double area_per_step_m2 = 2 * kPi * radius_m * step_m;
    std::vector<ContactPoint> before;
    for (double depth_m = -3e-4; depth_m < std::min(5e-4, radius_m / 2); depth_m += step_m) {
      const auto now = on_floor(radius_m, depth_m);
      const auto force_in = [](const std::vector<ContactPoint>& contacts, double closed_m) {
        double sum = 0;
        for (const ContactPoint& c : contacts) sum += c.area_m2 * std::max(0.0, c.depth_m + closed_m);
        return sum;
      };
      // Compares the forces of two consecutive steps, after the surfaces have approached by `closed_m`. The force may
      // change by at most the depth × area of the points that enter or leave the band.
      for (const double closed_m : {0.0, 5e-5, kBallContactsBand_m}) {
        const double most = 2 * area_per_step_m2 * (std::max(0.0, depth_m) + kBallContactsBand_m + closed_m);
        ASSERT_NEAR(force_in(now, closed_m), force_in(before, closed_m), most) << radius_m << " " << depth_m;
      }
      before = now;
    }
  }
}

/// Returns the pose of a ball of radius 5 mm that presses the top of a box of 2 cm, by default 50 µm deep. It touches
/// the box `inside_m` from an edge, and is rotated as if it had rolled from this edge.
Pose beside_edge(double inside_m, double depth_m = 5e-5) {
  return {Vec3(0.01 - inside_m, 0.0013, 0.015 - depth_m), quaternion_of(Vec3(0, -inside_m / 5e-3, 0))};
}

std::vector<ShapePointer> boxes() {
  const Vec3 size_m = Vec3::Constant(0.02);
  return {make_contact_box(size_m), solid_of(box_mesh(size_m))};
}

TEST(BallContacts, GoOverIntoPointsWithoutAStepInForce) {
  const ShapePointer ball = make_contact_sphere(5e-3);
  for (const ShapePointer& box : boxes()) {
    ContactPair pair;
    pair.bind(ball.get(), box.get());
    std::vector<double> forces_n;
    int changes = 0;
    bool was_closed_form = true;
    double most_n = 0;
    for (double inside_m = 3e-3; inside_m > 0; inside_m -= 1e-5) {
      pair.find(beside_edge(inside_m), {}, kBallContactsBand_m);
      const Touch touch(pair);
      forces_n.push_back(touch.force_W.norm());
      if (touch.is_closed_form != was_closed_form) ++changes;
      was_closed_form = touch.is_closed_form;
      if (forces_n.size() > 1) most_n = std::max(most_n, std::abs(forces_n.back() - forces_n[forces_n.size() - 2]));
    }
    EXPECT_FALSE(was_closed_form);
    EXPECT_EQ(changes, 1);
    // Only the ball's points press here, because the faces of the box have no points in their interior. The limit is
    // slightly above the change of force when one of the ball's points leaves.
    EXPECT_LT(most_n, 0.11 * forces_n.front());
  }
}

/// The ball is outside of the box, beside an edge. The box's grid underestimates distances far from the surface, so it
/// does not exclude a contact. Fails if the planes of the box's faces are not tested as well.
TEST(BallContacts, OfABallThatIsClearBesideAnEdgeThereIsNone) {
  const double radius_m = 5e-3, half_m = 0.01;
  const ShapePointer ball = make_contact_sphere(radius_m);
  for (const ShapePointer& box : boxes()) {
    ContactPair pair;
    pair.bind(ball.get(), box.get());
    for (double x_m = 0.2e-3; x_m < 9e-3; x_m += 0.25e-3) {
      for (double z_m = 0.2e-3; z_m < 9e-3; z_m += 0.25e-3) {
        if (std::hypot(x_m, z_m) < radius_m + 0.3e-3) continue;
        pair.find({Vec3(half_m + x_m, 0.0013, half_m + z_m), Quat::Identity()}, {}, kBallContactsBand_m);
        EXPECT_EQ(Touch(pair).force_W, Vec3(0, 0, 0)) << x_m << " " << z_m;
      }
    }
  }
}

TEST(BallContacts, KeepFrictionWhenTheyGoOverIntoPointsAndBack) {
  const ShapePointer ball = make_contact_sphere(5e-3);
  for (const ShapePointer& box : boxes()) {
    ContactPair pair;
    for (const bool is_ball_a : {true, false}) {
      pair.bind(is_ball_a ? ball.get() : box.get(), is_ball_a ? box.get() : ball.get());
      const auto find = [&](const Pose& X_WS) {
        pair.find(is_ball_a ? X_WS : Pose(), is_ball_a ? Pose() : X_WS, kBallContactsBand_m);
        return Touch(pair);
      };
      for (const auto& [from_m, to_m] : {std::pair(3e-3, 9e-4), std::pair(9e-4, 3e-3)}) {
        const Touch start = find(beside_edge(from_m));
        for (ContactPoint& contact : pair.contacts()) {
          if (contact.depth_m <= 0) continue;
          const Vec3 slip = Vec3(2e-6, 1e-6, 0) + 1e-3 * Vec3::UnitZ().cross(contact.p_W);
          contact.bristle_W = slip - contact.normal_W * contact.normal_W.dot(slip);
        }
        const Touch before(pair);
        const Touch after = find(beside_edge(to_m));
        ASSERT_NE(start.is_closed_form, after.is_closed_form);
        ASSERT_EQ(start.is_closed_form, from_m > to_m);
        // The tolerance of 3 % is for the contacts at the plane's points. Their normals are those of the ball, so they
        // are slightly tilted.
        EXPECT_LT((after.friction_W - before.friction_W).norm(), 0.03 * before.friction_W.norm());
        EXPECT_NE(before.moment_z, 0);
        EXPECT_NEAR(after.moment_z, before.moment_z, 0.01 * std::abs(before.moment_z));
      }
    }
  }
}

TEST(BallContacts, KeepFrictionWhileTheBallRollsAndIsPressedDeeper) {
  const ContactShape ball = ball_of(5e-3), box = box_of(0.04);
  ContactPair pair;
  pair.bind(&ball, &box);
  const auto find = [&](double x_m, double depth_m) {
    pair.find({Vec3(x_m, 0, 0.025 - depth_m), quaternion_of(Vec3(0, x_m / 5e-3, 0))}, {}, kBallContactsBand_m);
    return Touch(pair);
  };
  find(0, 5e-5);
  for (ContactPoint& contact : pair.contacts())
    contact.bristle_W = 0.1 * std::max(0.0, contact.depth_m) * Vec3::UnitX();
  const Vec3 start_W = Touch(pair).friction_W;
  for (int i = 1; i <= 100; ++i) {
    EXPECT_LT((find(5e-5 * i, 5e-5).friction_W - start_W).norm(), 1e-9 * start_W.norm()) << i;
  }
  EXPECT_NEAR(find(5e-3, 8e-5).friction_W.norm(), start_W.norm(), 1e-9 * start_W.norm());
  EXPECT_LT(find(5e-3, 5e-5).friction_W.norm(), start_W.norm());
}

/// Returns the energy, including the elastic energy stored in friction.
double energy_j(TouchRig& rig) {
  double energy = rig.energy_j();
  for (const ContactPoint& c : rig.contacts()) {
    energy += 0.5 * kTangentialRatio * kBallContactsStiffness_n_per_m3 * c.area_m2 * c.bristle_W.squaredNorm();
  }
  return energy;
}

TEST(BallContacts, MakeNoEnergyWhileABallBouncesSlidesAndRolls) {
  const double radius_m = 5e-3, mass_kg = 0.02;
  const ShapePointer ball = make_contact_sphere(radius_m);
  const ShapePointer floor = make_contact_box({0.3, 0.3, 0.02});
  for (const Twist& start : {Twist{Vec3(0.1, 0, 0), Vec3::Zero()}, Twist{Vec3(0.02, 0.1, 0), Vec3(0, 40, 20)},
                             Twist{Vec3(0.1, 0, -0.2), Vec3(0, 20, 0)}}) {
    ContactSolver solver({});
    TouchRig rig(solver);
    rig.shape = ball;
    rig.mass_kg = mass_kg;
    rig.inertia_B = sphere_inertia(mass_kg, radius_m);
    rig.X_WB.p = Vec3(0, 0, radius_m + 1e-5);
    rig.V_WB = start;
    rig.gravity_m_per_s2 = kGravity_m_per_s2;
    rig.add_obstacle(floor, {Vec3(0, 0, -0.01), Quat::Identity()});
    double least_j = energy_j(rig);
    const double first_j = least_j - mass_kg * kGravity_m_per_s2 * radius_m;
    for (int i = 0; i < 1000; ++i) {
      rig.step();
      const double now_j = energy_j(rig);
      ASSERT_LT(now_j - least_j, 1e-5 * first_j) << i;
      least_j = std::min(least_j, now_j);
    }
  }
}

TEST(BallContacts, HoldABallOnASlopeThoughItsWeightTrembles) {
  const double radius_m = 5e-3;
  const ShapePointer ball = make_contact_sphere(radius_m);
  const Quat slope = quaternion_of(Vec3(0, 0.2, 0));
  for (const double share : {0.02, 0.1}) {
    for (const int period : {2, 20}) {
      ContactSolver solver({});
      TouchRig rig(solver);
      rig.shape = ball;
      rig.inertia_B = Eigen::Matrix3d::Identity();  // large, so that the ball hardly rolls
      rig.X_WB = {slope * Vec3(0, 0, radius_m - 7e-5), slope};
      rig.add_obstacle(make_contact_box({0.3, 0.3, 0.02}), {slope * Vec3(0, 0, -0.01), slope});
      rig.gravity_m_per_s2 = kGravity_m_per_s2;
      rig.run(0.3);
      const Vec3 start = rig.X_WB.p;
      for (int i = 0; i < 1000; ++i) {
        rig.gravity_m_per_s2 = kGravity_m_per_s2 * (1 + (i % period < period / 2 ? share : -share));
        rig.step();
      }
      // Limit of the motion within one second, at a depth of 73 µm. Measured were 14 µm. If each deeper step shortened
      // all bristles (elastic displacements of friction), the ball would creep by 91 µm.
      EXPECT_LT((rig.X_WB.p - start).norm(), 2e-5) << share << " " << period;
    }
  }
}

}  // namespace
}  // namespace tandem::contact
