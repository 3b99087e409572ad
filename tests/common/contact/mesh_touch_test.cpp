// Tests that users feel small details of realistic meshes with many triangles.
#include <gtest/gtest.h>

#include <tuple>

#include "common/contact/contact_reduction.hpp"
#include "common/contact/lanes/avx2.hpp"
#include "tests/common/contact/mesh_measures.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/common/contact/touch_rig.hpp"
#include "tests/support/needs.hpp"

namespace tandem::contact {
namespace {

/// A plate of 100 × 100 mm with one million triangles. It has a ridge along y that is `ridge_m` high and 0.3 mm wide at
/// its foot.
geometry::TriangleMesh ridged_plate(double ridge_m) {
  const double foot_m = 1.5e-4;
  geometry::TriangleMesh mesh =
      height_field(0.1, 708, [&](double x, double) { return ridge_m * std::max(0.0, 1 - std::abs(x) / foot_m); });
  // The plate becomes a solid by a fan of triangles between its border and a point below, which forms its sides and
  // bottom.
  const int row = 709;
  const int below = static_cast<int>(mesh.vertices.size());
  mesh.vertices.emplace_back(0, 0, -0.01);
  std::vector<int> border;
  for (int i = 0; i < row - 1; ++i) border.push_back(i);
  for (int j = 0; j < row - 1; ++j) border.push_back(j * row + row - 1);
  for (int i = row - 1; i > 0; --i) border.push_back((row - 1) * row + i);
  for (int j = row - 1; j > 0; --j) border.push_back(j * row);
  for (std::size_t i = 0; i < border.size(); ++i) {
    mesh.triangles.push_back({border[(i + 1) % border.size()], border[i], below});
  }
  return mesh;
}

TEST(MeshTouch, ARidgeOfThreeTenthsOfAMillimetreOnAMillionTrianglesLiftsASlidingBall) {
  // The squares of the plate are 0.14 mm wide, so the crest of the ridge must be on a grid line. Otherwise the ridge
  // would be lower than 0.3 mm.
  geometry::TriangleMesh mesh = ridged_plate(3e-4);
  double crest_m = 0;
  for (const Vec3& vertex : mesh.vertices) crest_m = std::max(crest_m, vertex.z());
  ASSERT_GT(mesh.triangles.size(), 990'000U);
  ContactSolver solver({});
  TouchRig rig(solver);
  rig.shape = make_contact_sphere(0.005);
  rig.friction = 0.1;
  rig.add_obstacle(solid_of(mesh));
  const auto law =
      haptics::make_coupling_law("spring-damper", critical_coupling(rig.mass_kg, rig.inertia_B(0, 0), 1000));
  rig.law = law.get();
  rig.coupling_force_n = 6.5;
  rig.X_WB.p = {-0.006, 0.0123, 0.0051};
  rig.X_WH = rig.X_WB;
  rig.X_WH.p.z() = 0.004;
  rig.run(0.1);
  const double flat_m = rig.X_WB.p.z();
  const double flat_n = rig.tool_wrench_W.f.z();
  double highest_m = flat_m;
  double most_n = 0;
  for (int i = 0; i < 600; ++i) {
    rig.X_WH.p.x() += 0.02 * kStep_s;
    rig.V_WH.v.x() = 0.02;
    rig.step();
    highest_m = std::max(highest_m, rig.X_WB.p.z());
    most_n = std::max(most_n, std::abs(rig.tool_wrench_W.f.z() - flat_n));
  }
  EXPECT_GT(rig.X_WB.p.x(), 0.004);
  // The ball rolls over the crest. It penetrates the crest by less than the rigid depth.
  EXPECT_NEAR(crest_m, 3e-4, 1e-9);
  EXPECT_GT(highest_m - flat_m, 0.5 * crest_m);
  EXPECT_GT(most_n, 0.5 * crest_m * 1000);
}

/// Compares the reported derivative with finite differences of the search. Lengths are in units of 5 cm.
TEST(TouchDerivative, IsThatOfTheSearchForTwoBunnies) {
  TANDEM_NEEDS_FILES(kBunnyFile);
  const geometry::TriangleMesh mesh = bunny_mesh(0.1);
  const ShapePointer bunny = solid_of(mesh);
  const auto wrench_at = [&](const Pose& X_WA, const Vec3& about) {
    ContactPair pair(8192);
    pair.bind(bunny.get(), bunny.get());
    pair.find(X_WA, {}, 2e-4);
    return contact_wrench(pair.contacts(), 5e9, about);
  };
  const double unit_m = 0.05;
  Vec6 scale;
  scale << 1, 1, 1, 1 / unit_m, 1 / unit_m, 1 / unit_m;
  for (const Vec3& from : {Vec3(1, 0, 0), Vec3(0, 1, 0.2), Vec3(-0.3, 0.2, 1)}) {
    Pose X_WA{0.2 * from.normalized(), quaternion_of(from)};
    while (wrench_at(X_WA, X_WA.p).on_a_W.f.norm() < 5) X_WA.p -= 2e-5 * from.normalized();
    Mat6 searched;
    for (int axis = 0; axis < 6; ++axis) {
      const double step = axis < 3 ? 1e-6 : 1e-5;
      searched.col(axis).setZero();
      for (const double sign : {1.0, -1.0}) {
        Pose moved = X_WA;
        if (axis < 3) moved.p[axis] += sign * step;
        if (axis >= 3) moved.q = quaternion_of(sign * step * Vec3::Unit(axis - 3)) * X_WA.q;
        const Wrench wrench = wrench_at(moved, X_WA.p).on_a_W;
        searched.col(axis).head<3>() += sign / (2 * step) * wrench.f;
        searched.col(axis).tail<3>() += sign / (2 * step) * wrench.t;
      }
    }
    const Mat6 stated = wrench_at(X_WA, X_WA.p).derivative;
    const double error = (scale.asDiagonal() * (stated - searched) * scale.asDiagonal()).norm();
    EXPECT_LT(error, 0.1 * (scale.asDiagonal() * searched * scale.asDiagonal()).norm()) << from.transpose();
  }
}

TEST(Drop, ABunnyComesToRestAndNeverGainsEnergy) {
  TANDEM_NEEDS_FILES(kBunnyFile);
  const geometry::TriangleMesh mesh = bunny_mesh(0.1);
  ContactSolver solver({});
  TouchRig rig(solver);
  rig.shape = solid_of(mesh);
  rig.mass_kg = 0.1;
  rig.inertia_B = sphere_inertia(0.1, 0.04);
  rig.X_WB = {{0, 0, 0.1}, quaternion_of({1, 0.3, 0})};
  rig.gravity_m_per_s2 = kGravity_m_per_s2;
  rig.add_obstacle(make_contact_box({1, 1, 0.05}), {{0, 0, -0.025}, Quat::Identity()});
  const double start_j = rig.energy_j();
  double least_j = start_j;
  double risen_j = 0;
  for (int i = 0; i < 3000; ++i) {
    rig.step();
    const double energy_j = rig.energy_j();
    risen_j = std::max(risen_j, energy_j - least_j);
    least_j = std::min(least_j, energy_j);
  }
  EXPECT_LT(risen_j, 1e-4 * (start_j - least_j));
  EXPECT_GT(start_j - least_j, 0.01);
  EXPECT_LT(rig.speed_m_per_s(), 5e-3);
}

/// Returns the state after a ball made of triangles has fallen on another ball and rolled off.
std::tuple<Pose, Vec3, double> after_a_fall(const ShapePointer& ball) {
  ContactSolver solver({});
  TouchRig rig(solver);
  rig.shape = ball;
  rig.mass_kg = 0.1;
  rig.inertia_B = sphere_inertia(0.1, 0.02);
  rig.X_WB = {{0.005, 0.003, 0.0405}, quaternion_of({1, 0.3, 0})};
  rig.gravity_m_per_s2 = kGravity_m_per_s2;
  rig.add_obstacle(ball);
  double most_n = 0;
  for (int i = 0; i < 150; ++i) {
    rig.step();
    most_n = std::max(most_n, rig.normal_force_n);
  }
  return {rig.X_WB, rig.V_WB.v, most_n};
}

TEST(Lanes, AFallIsTheSameToTheBitWithAndWithoutAvx2) {
  TANDEM_NEEDS_OF_MACHINE(uses_avx2(), "a processor with AVX2");
  const ShapePointer ball = solid_of(sphere_mesh(0.02, 3));
  const auto [X_WB, v_W, most_n] = after_a_fall(ball);
  uses_avx2() = false;
  const auto [X_WB_portable, v_W_portable, most_n_portable] = after_a_fall(ball);
  uses_avx2() = true;
  EXPECT_GT(most_n, 1);
  EXPECT_EQ(most_n, most_n_portable);
  EXPECT_EQ(X_WB.p, X_WB_portable.p);
  EXPECT_EQ(X_WB.q.coeffs(), X_WB_portable.q.coeffs());
  EXPECT_EQ(v_W, v_W_portable);
}

}  // namespace
}  // namespace tandem::contact
