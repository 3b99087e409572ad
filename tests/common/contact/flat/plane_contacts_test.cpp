#include "common/contact/flat/plane_contacts.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <tuple>

#include "common/contact/contact_pair.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "tests/common/contact/hand_made_shell.hpp"
#include "tests/common/contact/test_meshes.hpp"

namespace tandem::contact {
namespace {

constexpr double kEdge_m = 0.02;
constexpr double kPlaneContactsBand_m = 2e-4;
constexpr double kPlaneContactsStiffness_n_per_m3 = 5e9;

/// A cube mesh that is rotated relative to the lattice of its distance grid.
std::shared_ptr<const ContactShape> oblique_cube(const Quat& q_SB) {
  geometry::TriangleMesh mesh = box_mesh(Vec3::Constant(kEdge_m));
  for (Vec3& vertex : mesh.vertices) vertex = q_SB * vertex;
  return make_contact_mesh({mesh, geometry::SurfaceKind::kSolid, {}});
}

/// Sum of the contact forces on A, with the torque about the world origin.
struct Pressure {
  Wrench on_a_W;
  double stiffness_n_per_m = 0;

  void add(const Vec3& p_W, const Vec3& normal_W, double depth_m, double area_m2) {
    if (depth_m <= 0) return;
    const Vec3 force = kPlaneContactsStiffness_n_per_m3 * area_m2 * depth_m * normal_W;
    on_a_W += {force, p_W.cross(force)};
    stiffness_n_per_m += kPlaneContactsStiffness_n_per_m3 * area_m2;
  }
};

Pressure of_contacts(const ContactPair& pair) {
  Pressure sum;
  for (const ContactPoint& contact : pair.contacts()) {
    sum.add(contact.p_W, contact.normal_W, contact.depth_m, contact.area_m2);
  }
  return sum;
}

void add_all_points(const ContactShape& points, const Pose& X_WP, const ContactShape& solid, const Pose& X_WF,
                    double sign, Pressure& sum) {
  const Pose X_FP = X_WF.inverse() * X_WP;
  for (const ShellPoint& point : points.shells.surface.points) {
    const Vec3 p_P = point.p_S.cast<double>();
    const DistanceSample sample = solid.field->sample(X_FP * p_P);
    sum.add(X_WP * p_P, sign * (X_WF.q * sample.gradient.normalized()), -sample.distance_m, point.area_m2 / 2);
  }
}

Pressure of_all_points(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB) {
  Pressure sum;
  add_all_points(a, X_WA, b, X_WB, 1, sum);
  add_all_points(b, X_WB, a, X_WA, -1, sum);
  return sum;
}

/// Cube A lies on cube B, whose upper face is z = 0. The midpoint of A's lower edge at x < 0 is `depth_m` below that
/// face.
struct Stack {
  std::shared_ptr<const ContactShape> shape;
  Quat q_SB;

  Pose X_WB() const { return {Vec3(0, 0, -kEdge_m / 2), q_SB.conjugate()}; }
  Pose X_WA(double depth_m, double tilt, double turn = 0.2) const {
    const Quat q = Quat(Eigen::AngleAxisd(tilt, Vec3::UnitY())) * Quat(Eigen::AngleAxisd(turn, Vec3::UnitZ()));
    const double lowest_m = kEdge_m / 2 * std::sin(tilt) * (std::cos(turn) + std::sin(turn));
    return {Vec3(0.002, 0.001, kEdge_m / 2 + lowest_m - depth_m), q * q_SB.conjugate()};
  }
};

Stack oblique_stack() {
  const Quat q_SB(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  return {oblique_cube(q_SB), q_SB};
}

// Checks the planes that a field reports for random boxes. The largest distance to the planes must equal the field's
// distance.
//
// In      at_edges_m  tolerance if the field reports several planes; the samples are interpolated across the edge
//                     between them
void expect_planes_are_right(const DistanceField& field, double reach_m, double tolerance_m, double at_edges_m,
                             unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  std::size_t found = 0, found_of_several = 0;
  for (int i = 0; i < 20'000; ++i) {
    OrientedBox box;
    box.axes = Quat(Eigen::AngleAxisd(3 * uniform(random), vector().normalized())).toRotationMatrix();
    if (i % 2 == 0) box.axes = Eigen::Matrix3d::Identity();
    box.half_m = Vec3(2e-3, 2e-3, 3e-4).cwiseProduct(vector().cwiseAbs());
    box.centre = reach_m * vector();
    std::size_t queries = 0;
    const PlaneSet planes = field.planes_over(box, queries);
    ASSERT_GT(queries, 0U);
    if (planes == 0) continue;
    ++found;
    found_of_several += std::popcount(planes) > 1 ? 1 : 0;
    for (int k = 0; k < 30; ++k) {
      const Vec3 p = box.centre + box.axes * vector().cwiseProduct(box.half_m);
      const double distance = field.sample(p).distance_m;
      double largest = -1;
      for (std::size_t plane = 0; plane < field.planes().size(); ++plane) {
        if ((planes >> plane & 1U) != 0) largest = std::max(largest, field.planes()[plane].distance_m(p));
      }
      // Two differences are allowed. Deep inside, both distances exceed any contact depth. Outside of an edge, the
      // field's distance may be larger than that to the planes.
      if (distance < -5e-4 && largest < -5e-4) continue;
      const double most = (std::popcount(planes) > 1 ? at_edges_m : tolerance_m) + 0.01 * std::abs(distance);
      if (largest > 0) {
        ASSERT_GE(distance, largest - most) << "seed " << seed;
      } else {
        ASSERT_NEAR(distance, largest, most) << "seed " << seed;
      }
    }
  }
  EXPECT_GT(found, 50U);
  if (at_edges_m > 0) {
    EXPECT_GT(found_of_several, 20U);
  }
}

TEST(PlaneMap, IsWhereSamplesLieOnAPlane) {
  expect_planes_are_right(*oblique_cube(Quat::Identity())->field, 0.013, 3e-6, 1.5e-4, 1);
  expect_planes_are_right(*oblique_stack().shape->field, 0.015, 3e-6, 1.5e-4, 2);
}

// The planes through the faces of a wall continue beyond the end of the wall. A box that overhangs the end may have all
// its corners outside of one of the planes. Fails if only the corners are tested, and the planes are therefore
// accepted.
TEST(PlaneMap, OfAThinWallEndsWhereTheWallDoes) {
  constexpr int kSides = 16;
  constexpr double kOuter_m = 0.0375, kInner_m = 0.03625, kHalf_m = 0.02;
  geometry::TriangleMesh tube;
  for (const auto& [radius_m, z_m] : {std::pair(kOuter_m, -kHalf_m), std::pair(kOuter_m, kHalf_m),
                                      std::pair(kInner_m, kHalf_m), std::pair(kInner_m, -kHalf_m)}) {
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSides;
      tube.vertices.emplace_back(radius_m * std::cos(angle), radius_m * std::sin(angle), z_m);
    }
  }
  for (int ring = 0; ring < 4; ++ring) {
    for (int i = 0; i < kSides; ++i) {
      const int a = kSides * ring + i, b = kSides * ring + (i + 1) % kSides;
      const int c = (a + kSides) % (4 * kSides), d = (b + kSides) % (4 * kSides);
      tube.triangles.push_back({a, b, d});
      tube.triangles.push_back({a, d, c});
    }
  }
  const auto shape = make_contact_mesh({tube, geometry::SurfaceKind::kSolid, {}});
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double across_m = kOuter_m * std::cos(std::numbers::pi / kSides);
  std::size_t found = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double side = (i % kSides + 0.5) * 2 * std::numbers::pi / kSides;
    const Quat q = Quat(Eigen::AngleAxisd(side, Vec3::UnitZ())) *
                   Quat(Eigen::AngleAxisd(0.2 * uniform(random), Vec3::UnitY())) *
                   Quat(Eigen::AngleAxisd(0.1 * uniform(random), Vec3::UnitX()));
    OrientedBox box;
    box.axes = q.toRotationMatrix();
    box.half_m = Vec3(1e-6, 5e-3, kHalf_m);
    box.centre = Quat(Eigen::AngleAxisd(side, Vec3::UnitZ())) *
                 Vec3(across_m + 3e-3 * uniform(random), 5e-3 * uniform(random), kHalf_m * (1 + uniform(random)));
    std::size_t queries = 0;
    const PlaneSet planes = shape->field->planes_over(box, queries);
    if (planes == 0) continue;
    ++found;
    for (int k = 0; k < 30; ++k) {
      const Vec3 off(uniform(random), uniform(random), uniform(random));
      const Vec3 p = box.centre + box.axes * off.cwiseProduct(box.half_m);
      ASSERT_FALSE(shape->field->distance_m(p) > 3e-4 && largest_m(shape->field->planes(), planes, p) < 0)
          << "box " << i;
    }
  }
  EXPECT_GT(found, 50U);
}

TEST(PlaneMap, OfPrimitivesIsByFormula) {
  expect_planes_are_right(*box_field(Vec3(0.02, 0.03, 0.01)), 0.02, 1e-15, 1e-15, 3);
  expect_planes_are_right(*cylinder_field(0.01, 0.02), 0.013, 1e-15, 0, 4);
  expect_planes_are_right(*half_space_field(), 0.01, 1e-15, 0, 5);
}

TEST(PlaneContacts, HaveTheForceAndMomentOfAllPoints) {
  const Stack stack = oblique_stack();
  ContactPair pair;
  for (const double tilt : {0.0, 1e-5, 1e-4, 1e-3, 1e-2}) {
    for (const double depth_m : {2e-5, 5e-5, 2e-4}) {
      pair.bind(stack.shape.get(), stack.shape.get());
      const Pose X_WA = stack.X_WA(depth_m, tilt);
      const ContactWork work = pair.find(X_WA, stack.X_WB(), kPlaneContactsBand_m);
      EXPECT_FALSE(work.is_coarse);
      const Pressure few = of_contacts(pair);
      const Pressure all = of_all_points(*stack.shape, X_WA, *stack.shape, stack.X_WB());
      // Tolerance: distances are rounded to 2 µm at depths of at most 20 µm, and points beside an edge are not evenly
      // spread.
      const double error_n = 0.02 * all.on_a_W.f.norm() + 9e-7 * all.stiffness_n_per_m;
      EXPECT_NEAR((few.on_a_W.f - all.on_a_W.f).norm(), 0, error_n) << "tilt " << tilt << ", depth " << depth_m;
      EXPECT_NEAR((few.on_a_W.t - all.on_a_W.t).norm(), 0, error_n * kEdge_m) << "tilt " << tilt;
      EXPECT_LE(few.on_a_W.f.cross(all.on_a_W.f).norm(), 0.0175 * few.on_a_W.f.norm() * all.on_a_W.f.norm());
    }
  }
}

// Tests the end faces of prisms, which are polygons but not rectangles.
TEST(PlaneContacts, OfAPolygonHaveTheForceAndMomentOfAllPoints) {
  constexpr double kHeight_m = 0.02;
  for (const int sides : {3, 6, 12}) {
    const auto shape = make_contact_mesh({prism_mesh(sides, 0.02, kHeight_m), geometry::SurfaceKind::kSolid, {}});
    for (const double tilt : {0.0, 1e-4, 1e-3, 1e-2}) {
      for (const double depth_m : {2e-5, 2e-4}) {
        ContactPair pair(8192);
        pair.bind(shape.get(), shape.get());
        const Quat q = Quat(Eigen::AngleAxisd(tilt, Vec3::UnitY())) * Quat(Eigen::AngleAxisd(0.3, Vec3::UnitZ()));
        const Pose X_WA{Vec3(0.002, 0.001, kHeight_m + 0.015 * std::sin(tilt) - depth_m), q};
        const ContactWork work = pair.find(X_WA, Pose{}, kPlaneContactsBand_m);
        EXPECT_FALSE(work.is_coarse) << sides << ", " << tilt << ", " << depth_m;
        const Pressure few = of_contacts(pair);
        const Pressure all = of_all_points(*shape, X_WA, *shape, Pose{});
        const double error_n = 0.02 * all.on_a_W.f.norm() + 9e-7 * all.stiffness_n_per_m;
        EXPECT_GT(all.on_a_W.f.norm(), 0.02);
        EXPECT_NEAR((few.on_a_W.f - all.on_a_W.f).norm(), 0, error_n) << sides << ", " << tilt << ", " << depth_m;
        EXPECT_NEAR((few.on_a_W.t - all.on_a_W.t).norm(), 0, error_n * 0.02)
            << sides << ", " << tilt << ", " << depth_m;
      }
    }
  }
}

TEST(PlaneContacts, AFaceOnAFaceHasFewOfThem) {
  const Stack stack = oblique_stack();
  ContactPair pair;
  pair.bind(stack.shape.get(), stack.shape.get());
  pair.find(stack.X_WA(2e-5, 0), stack.X_WB(), kPlaneContactsBand_m);
  std::size_t pressing = 0;
  for (const ShellPoint& point : stack.shape->shells.surface.points) {
    const Pose X_BA = stack.X_WB().inverse() * stack.X_WA(2e-5, 0);
    pressing += stack.shape->field->distance_m(X_BA * point.p_S.cast<double>()) < 0 ? 1 : 0;
  }
  EXPECT_GT(pressing, 1000U);
  EXPECT_LT(pair.contacts().size(), 600U);
}

// The hole hardly changes the statistics of the face's points: their mean and deviations are almost those of a full
// rectangle. Fails if the face counts as full; it would then press on the rod inside the hole.
TEST(PlaneContacts, NothingPressesOnARodInAHole) {
  // Centre of the plate, relative to the hole. In both cases, the hole is well inside one tree node of some thousand
  // points.
  for (const Vec3& middle : {Vec3(0.1 / 12, 0.003125, 0), Vec3(0.125 / 12, 0.009375, 0)}) {
    const auto plate =
        make_contact_mesh({block_with_hole_mesh(3e-3, 0.1, 0.005, middle), geometry::SurfaceKind::kSolid, {}});
    const auto rod = make_contact_box({2.5e-3, 2.5e-3, 0.1});
    const auto pressed_at = [&](const Vec3& p_W) {
      ContactPair pair;
      pair.bind(rod.get(), plate.get());
      pair.find({p_W, Quat::Identity()}, Pose{}, kPlaneContactsBand_m);
      return of_contacts(pair);
    };
    for (const double z_m : {0.0, 0.0525, 0.05499}) {
      EXPECT_EQ(pressed_at({0, 0, z_m}).stiffness_n_per_m, 0) << middle.transpose() << ", rod at " << z_m;
    }
    EXPECT_LT(pressed_at({3e-4, 0, 0}).on_a_W.f.x(), 0) << "against the wall of the hole";
  }
}

// With 5e9 N/m³, a face of 20 mm has a stiffness of 2 N/µm. If the few contacts that represent the face changed
// abruptly with the tilt, the user would feel steps of the force.
TEST(PlaneContacts, ForceHasNoStepsWhileABoxTilts) {
  const Stack stack = oblique_stack();
  ContactPair pair;
  pair.bind(stack.shape.get(), stack.shape.get());
  double few_n = 0, all_n = 0;
  for (int i = 0; i <= 400; ++i) {
    const double tilt = 2e-3 * i / 400;
    const Pose X_WA = stack.X_WA(2e-5, tilt);
    pair.find(X_WA, stack.X_WB(), kPlaneContactsBand_m);
    const double few_now_n = of_contacts(pair).on_a_W.f.norm();
    if (i % 4 == 0) {
      const double all_now_n = of_all_points(*stack.shape, X_WA, *stack.shape, stack.X_WB()).on_a_W.f.norm();
      // Tolerance: along edges, distances from interpolated samples are more rounded than distances to the planes.
      EXPECT_NEAR(few_now_n, all_now_n, 0.02 * all_now_n + 0.3) << "tilt " << tilt;
      all_n = all_now_n;
    }
    if (i > 0) {
      EXPECT_NEAR(few_now_n, few_n, 0.02 * few_n + 0.2) << "tilt " << tilt;
    }
    few_n = few_now_n;
  }
  EXPECT_GT(all_n, 1);
}

TEST(PlaneContacts, ForceFollowsTheOverlapWhileABoxSlidesOverAnEdge) {
  const auto below = make_contact_box({0.03, 0.03, 0.03});
  const auto box = make_contact_box({0.02, 0.02, 0.02});
  ContactPair pair;
  pair.bind(box.get(), below.get());
  const double depth_m = 2e-5, step_m = 5e-5;
  double whole_n = 0, before_n = 0;
  for (int i = 0; i < 510; ++i) {
    const double x_m = i * step_m;
    pair.find({Vec3(x_m, 0.001, 0.025 - depth_m), Quat::Identity()}, {}, kPlaneContactsBand_m);
    const double now_n = of_contacts(pair).on_a_W.f.z();
    if (i == 0) whole_n = before_n = now_n;
    const double overlap = std::clamp((0.025 - x_m) / 0.02, 0.0, 1.0);
    ASSERT_NEAR(now_n, overlap * whole_n, 0.06 * whole_n) << x_m;
    // In one step, the block may lose a strip of 0.5 mm at each of two edges, which contain 5 % of its points.
    ASSERT_NEAR(now_n, before_n, 0.06 * whole_n) << x_m;
    before_n = now_n;
  }
  EXPECT_GT(whole_n, 10);
  EXPECT_NEAR(before_n, 0, 0.01 * whole_n);
}

// The points lie on the edges of a flight of stairs, which are in one plane with gaps between them. If the budget is
// too small, some contacts represent several points. Fails if such a contact lies in a gap, where it would be deeper
// than every point.
TEST(PlaneContacts, WithoutSpaceForAllNoContactIsDeeperThanTheDeepestPoint) {
  std::vector<ShellPoint> points;
  for (int nose = 0; nose < 8; ++nose) {
    for (int i = 0; i < 400; ++i) {
      points.push_back({Eigen::Vector3f(0.005F * static_cast<float>(nose), 1e-4F * static_cast<float>(i), 0),
                        Eigen::Vector3f::UnitZ(), 1e-9F});
    }
  }
  const PointShell shell = PointShell::make(std::move(points), 5e-4);
  ASSERT_NE(shell.nodes.at(0).flat, ShellNode::kNotFlat);
  const auto field = box_field(Vec3(0.004, 0.1, 0.02));
  std::vector<ContactPoint> contacts;
  contacts.reserve(shell.points.size() + kSmallNode);
  for (const std::size_t room : {std::size_t{0}, std::size_t{30}, std::size_t{100}, std::size_t{400}}) {
    // In the first position only the second edge is inside the box, in the second position only the first edge.
    for (const double x_m : {-0.0031, -0.001}) {
      const Pose X_FP{Vec3(x_m, 0, 0.005), Quat(Eigen::AngleAxisd(0.3, Vec3::UnitY()))};
      double deepest_m = 0;
      for (const ShellPoint& point : shell.points) {
        deepest_m = std::max(deepest_m, -field->distance_m(X_FP * point.p_S.cast<double>()));
      }
      const PlaneSet planes = (PlaneSet{1} << field->planes().size()) - 1;
      contacts.clear();
      PlaneContacts{
          shell, field->planes(), X_FP, X_FP, Eigen::Matrix3d::Identity(), kPlaneContactsBand_m, 0.01, 1, 1, 0, room}
          .add(0, planes, contacts);
      double found_m = 0;
      for (const ContactPoint& contact : contacts) found_m = std::max(found_m, contact.depth_m);
      EXPECT_LE(contacts.size(), room + least_contacts_of(shell.nodes[0])) << "room " << room << ", at " << x_m;
      EXPECT_GT(found_m, 0) << "room " << room << ", at " << x_m;
      EXPECT_LE(found_m, deepest_m + 1e-7) << "room " << room << ", at " << x_m;
    }
  }
}

// A dense group of points, and a small group far away. The mean of all points minus one standard deviation is between
// the groups, where no point is. Fails if a contact at this position presses although no point is below the plane.
TEST(PlaneContacts, NothingPressesWhereNoPointIs) {
  std::vector<ShellPoint> points;
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 10; ++k) {
      const float x_m = 2e-4F * static_cast<float>(k) + (i < 4 ? 0.06F : 0);
      points.push_back({Eigen::Vector3f(x_m, 2e-4F * static_cast<float>(i), 0), Eigen::Vector3f::UnitZ(), 1e-9F});
    }
  }
  const PointShell shell = PointShell::make(std::move(points), 5e-4);
  ASSERT_NE(shell.nodes.at(0).flat, ShellNode::kNotFlat);
  const auto field = box_field(Vec3(1, 1, 0.02));
  std::vector<ContactPoint> contacts;
  contacts.reserve(shell.points.size() + kSmallNode);
  // The dense group is 0.1 mm above the box, the small group 6 mm above it.
  const Pose X_FP{Vec3(0, 0, 0.0101), Quat(Eigen::AngleAxisd(-0.1, Vec3::UnitY()))};
  for (const std::size_t room : {std::size_t{0}, std::size_t{30}, std::size_t{400}}) {
    contacts.clear();
    const PlaneSet planes = (PlaneSet{1} << field->planes().size()) - 1;
    PlaneContacts{shell, field->planes(), X_FP, X_FP, Eigen::Matrix3d::Identity(), 0.02, 0.01, 1, 1, 0, room}.add(
        0, planes, contacts);
    EXPECT_FALSE(contacts.empty());
    for (const ContactPoint& contact : contacts) EXPECT_LT(contact.depth_m, 0) << "room " << room;
  }
}

TEST(PlaneContacts, BristlesStayWhileWhatStandsForThePointsChanges) {
  const Stack stack = oblique_stack();
  ContactPair pair;
  pair.bind(stack.shape.get(), stack.shape.get());
  const Vec3 bristle_W(1e-6, 2e-6, 0);
  pair.find(stack.X_WA(1e-4, 0), stack.X_WB(), kPlaneContactsBand_m);
  for (ContactPoint& contact : pair.contacts()) {
    if (contact.depth_m > 0) contact.bristle_W = bristle_W;
  }
  std::size_t size_before = pair.contacts().size();
  bool has_changed = false;
  for (const double tilt : {0.0, 1e-3, 4e-3, 1e-3, 0.0}) {
    pair.find(stack.X_WA(1e-4 + 0.02 * tilt, tilt), stack.X_WB(), kPlaneContactsBand_m);
    double weight = 0, weight_of_bristles = 0;
    for (ContactPoint& contact : pair.contacts()) {
      if (contact.depth_m <= 0 || contact.normal_W.z() < 0.99) continue;
      weight += contact.area_m2;
      weight_of_bristles += contact.area_m2 * contact.bristle_W.dot(bristle_W) / bristle_W.squaredNorm();
    }
    EXPECT_NEAR(weight_of_bristles, weight, 0.05 * weight) << "tilt " << tilt;
    has_changed = has_changed || pair.contacts().size() != size_before;
    size_before = pair.contacts().size();
  }
  EXPECT_TRUE(has_changed);
}

}  // namespace
}  // namespace tandem::contact
